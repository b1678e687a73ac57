"""The trigger: where a signal crosses a level, and the sweep of rows around that.

auto     sweeps, and rolls while there is no crossing
normal   sweeps only
single   one sweep, then waits until it is armed again
"""

from typing import Literal, NamedTuple

import numpy as np

from rtctl.scope.history import History

Edge = Literal["rising", "falling", "either"]
PATIENCE = 0.5  # s beyond one and a half sweeps until `auto` rolls


class Sweep(NamedTuple):
    """Rows `first` to `last` (not included) around the row `at`, the first one beyond the level."""

    first: int
    at: int
    last: int


def crossings(values: np.ndarray, level: float, edge: Edge) -> np.ndarray:
    """Indices i where values[i - 1] is on the one side of the level and values[i] on or beyond the other."""
    before, after = values[:-1], values[1:]
    rising = (before < level) & (after >= level)
    falling = (before > level) & (after <= level)
    found = rising if edge == "rising" else falling if edge == "falling" else rising | falling
    return np.flatnonzero(found) + 1


class Trigger:
    """Finds sweeps of `rows` rows, `before` of them before the crossing. `count` says how many it has found.

    The next crossing is looked for after the end of a sweep. `single` makes it stop after one.
    """

    def __init__(self, level: float, edge: Edge, rows: int, before: int, single: bool, start: int):
        self.level, self.edge, self.single = level, edge, single
        self.rows, self.before = rows, before
        self.count = 0
        self.waits_for: int | None = None  # the crossing whose sweep is not yet full
        self._looked = start  # rows before this one have been looked at

    @property
    def done(self) -> bool:
        return self.single and self.count > 0

    def feed(self, history: History, signal: str) -> Sweep | None:
        """Look at the rows that are new; returns the newest sweep that is full."""
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
        """The first crossing among rows not yet looked at."""
        first = max(self._looked - 1, history.first)
        values = history.take((signal,), first, history.head)[0]
        found = crossings(values, self.level, self.edge)
        self._looked = max(self._looked, history.head)
        return first + int(found[0]) if len(found) else None
