"""Log entries of trips and recorder errors. A trip is logged with its cause, its tick and the signals in that tick."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl.daemon.log import log
from rtctl.machines.base import COMMON_COLUMNS
from rtctl.tick import safety

COMMON = {column.name for column in COMMON_COLUMNS} - {"watchdog", "lateness"}


class Recording:
    """Logs errors of the recorder: a full disk, a folder that was renamed or deleted."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say, self._told = say, ""

    def look(self, trouble: str | None) -> None:
        """Log and print a new error, once."""
        if trouble and trouble != self._told:
            self._told = trouble
            log.error("recording", trouble=trouble)
            self._say(f"recording: {trouble}")


class Trips:
    """Logs the trips in the rows of a run, fed in their order."""

    def __init__(self) -> None:
        self._last = 0.0

    def feed(self, rows: np.ndarray) -> None:
        """Log each trip among the rows (n,), once."""
        causes = rows["trip"]
        before = np.concatenate([[self._last], causes[:-1]])
        self._last = float(causes[-1])
        for k in np.flatnonzero((causes != before) & (causes != safety.NONE)):
            row = rows[k]
            code, why = safety.TRIPS[int(row["trip"])]
            log.error("trip", cause=code, tick=int(row["tick"]), t=round(float(row["t"]), 6), why=why, **values(row))


def values(row: Any) -> dict[str, float]:
    """The machine's signals in a row, to five digits, without the truth_ columns of an emulator."""
    names = [n for n in row.dtype.names if n not in COMMON and not n.startswith("truth_")]
    return {name: float(f"{float(row[name]):.5g}") for name in names}
