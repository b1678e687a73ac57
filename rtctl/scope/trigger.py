"""The trigger: crossings of a level by a signal, and the sweep of rows around each.

auto     shows sweeps, and rolls while there is no crossing
normal   shows sweeps only
single   shows one sweep, then waits until it is armed again
"""

from typing import Literal, NamedTuple

import numpy as np

from rtctl.scope.history import History

Edge = Literal["rising", "falling", "either"]
PATIENCE = 0.5  # s after one and a half sweeps without a crossing, until `auto` rolls


class Sweep(NamedTuple):
    """Numbers of rows: `first` to `last` (not included), around `at`, the first row beyond the level."""

    first: int
    at: int
    last: int


def crossings(values: np.ndarray, level: float, edge: Edge) -> np.ndarray:
    """Indices i of crossings: values[i - 1] is on one side of the level, values[i] on the level or the other side."""
    before, after = values[:-1], values[1:]
    rising = (before < level) & (after >= level)
    falling = (before > level) & (after <= level)
    found = rising if edge == "rising" else falling if edge == "falling" else rising | falling
    return np.flatnonzero(found) + 1


class Trigger:
    """Finds sweeps of `rows` rows, `before` of them before the crossing. `count` is the number of sweeps found.

    The search for the next crossing begins at the end of a sweep. With `single` it ends after one sweep.
    """

    def __init__(self, level: float, edge: Edge, rows: int, before: int, single: bool, start: int):
        self.level, self.edge, self.single = level, edge, single
        self.rows, self.before = rows, before
        self.count = 0
        self.waits_for: int | None = None  # crossing whose sweep is not yet complete
        self._looked = start  # rows before this one have been searched

    @property
    def done(self) -> bool:
        return self.single and self.count > 0

    def feed(self, history: History, signal: str) -> Sweep | None:
        """Search the new rows; returns the newest complete sweep, or None."""
        latest = None
        while not self.done:
            at = self._find(history, signal) if self.waits_for is None else self.waits_for
            self.waits_for = at
            if at is None or at - self.before + self.rows > history.head:
                break
            last = at - self.before + self.rows
            latest = Sweep(last - self.rows, at, last)
            self.waits_for, self._looked = None, max(last, at + 1)
            self.count += 1
        return latest

    def _find(self, history: History, signal: str) -> int | None:
        """Number of the first row after a crossing, among rows not yet searched; None without a crossing."""
        first = max(self._looked - 1, history.first)
        values = history.take((signal,), first, history.head)[0]
        found = crossings(values, self.level, self.edge)
        self._looked = max(self._looked, history.head)
        return first + int(found[0]) if len(found) else None
