"""Lanes: signals of the model in `rtctl watch`, which come with the status, later than the rows.

A lane is drawn with a constant delay of DELAY seconds, so that a rolling page need not draw a column twice.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

DELAY = 3.0  # s by which a lane is drawn late: a window and the update intervals of watch and scope
KEPT = 30.0  # s of values kept


class Lanes:
    """Lanes by name, from the reports of a watch. `signals` are their names, units and descriptions."""

    def __init__(self) -> None:
        self.signals: list[dict[str, str]] = []
        self._kept: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the lanes, in order of arrival."""
        return tuple(self._kept)

    def take(self, model: Mapping[str, Any] | None) -> None:
        """Store the lanes of a report, if it has any."""
        if model is None or not model.get("t"):
            return
        t = np.asarray(model["t"], float)
        for name, lane in model.get("lanes", {}).items():
            values = np.asarray(lane["values"], float)
            if len(values) != len(t):
                continue
            if name not in self._kept:
                self._kept[name] = np.empty(0), np.empty(0)
                words = f"of the model beside the machine (rtctl watch), shown {DELAY:g} s late"
                self.signals.append({"name": name, "unit": lane["unit"], "help": words})
            old, kept = self._kept[name]
            if len(old) and t[-1] < old[-1]:  # another run
                old, kept = np.empty(0), np.empty(0)
            new = t > old[-1] if len(old) else np.ones(len(t), bool)
            old, kept = np.concatenate([old, t[new]]), np.concatenate([kept, values[new]])
            recent = old > old[-1] - KEPT
            self._kept[name] = old[recent], kept[recent]

    def at(self, t: np.ndarray, names: Iterable[str]) -> dict[str, np.ndarray]:
        """Values (n,) of each lane at the times `t` (n,) of rows, DELAY s late; 0 before the first value."""
        out = {}
        for name in names:
            old, kept = self._kept.get(name, (np.empty(0), np.empty(0)))
            out[name] = np.interp(t - DELAY, old, kept, left=0.0) if len(old) else np.zeros(len(t))
        return out
