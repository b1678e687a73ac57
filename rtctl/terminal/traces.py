"""Signals of the last half minute of a running machine, for the sparklines; every row where its ring can be read."""

import contextlib
from typing import Any

import numpy as np

from rtctl.daemon.tap import Tap
from rtctl.terminal.spark import Peaks
from rtctl.terminal.view import error_name


class Traces:
    """Tracking error and lateness over time. `signals` is the reply of the command of that name.

    The ring of a daemon on another computer or of another user cannot be read. Then each status gives one row, and
    `sampled` is true.
    """

    def __init__(self, signals: dict[str, Any]):
        self.units: dict[str, str] = {s["name"]: s["unit"] for s in signals["signals"]}
        self.error, self.lateness = Peaks(), Peaks()
        self.error_name = error_name(self.units)
        self._tap: Tap | None = None
        with contextlib.suppress(OSError, KeyError):
            self._tap = Tap(signals["ring"])

    @property
    def sampled(self) -> bool:
        return self._tap is None

    @property
    def filled(self) -> float | None:
        """Share of the ring that waits for the supervisor, 0 to 1; None where the ring cannot be read."""
        return None if self._tap is None else self._tap.filled

    def update(self, row: dict[str, float]) -> None:
        """Add the rows since the last call; `row` is the newest row in the status."""
        names = [name for name in ("t", "lateness", self.error_name) if name in self.units]
        if self._tap is not None:
            rows: Any = self._tap.take(names)
        else:
            rows = {name: np.array([row[name]]) for name in names if name in row}
        if "t" in names and len(rows) and len(rows["t"]):
            self.lateness.feed(rows["t"], rows["lateness"])
            if self.error_name is not None:
                self.error.feed(rows["t"], rows[self.error_name])
