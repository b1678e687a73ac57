"""Capture: selection of the rows before and after a trigger."""

import math
from collections import deque

import numpy as np

from rtctl.trace.trigger import Trigger


class Capture:
    """Passes on the rows from `pre_s` before the trigger to `duration_s` after it (s; inf for no end).

    Without a trigger the capture starts at the first row. `rate` is ticks per second. Time is counted in ticks: lost
    rows do not make a capture longer. Holds at most `pre_s` of rows, rounded up to batches. Raises ValueError for
    times or rates out of range.
    """

    def __init__(self, duration_s: float, pre_s: float, trigger: Trigger | None, rate: float):
        if not (duration_s > 0 and 0 <= pre_s < math.inf and 0 < rate < math.inf):
            raise ValueError(
                f"a capture needs a duration and a rate above 0 and a pre-trigger time of 0 or more;"
                f" they are {duration_s:g} s, {rate:g} Hz and {pre_s:g} s"
            )
        self._length = math.inf if math.isinf(duration_s) else max(1, round(duration_s * rate))  # ticks
        self._pre = round(pre_s * rate)  # ticks
        self._trigger = trigger
        self._before: deque[np.ndarray] = deque()
        self.trigger_tick: int | None = None  # None before the trigger
        self.done = False

    def prime(self, rows: np.ndarray) -> None:
        """Take rows from before the request for the capture. They can precede the trigger but not fire it."""
        if not len(rows):
            return
        if self._trigger:
            self._trigger(rows)
        self._hold(rows)

    def feed(self, rows: np.ndarray) -> tuple[np.ndarray, bool]:
        """Rows to write, of the next batch and of the rows held back, and whether the capture is complete."""
        if self.done or not len(rows):
            return rows[:0], self.done
        if self.trigger_tick is not None:
            return self._until_the_end(rows)
        index = self._trigger(rows) if self._trigger else 0
        if index < 0:
            self._hold(rows)
            return rows[:0], False
        self.trigger_tick = int(rows["tick"][index])
        rows = np.concatenate([*self._before, rows])
        self._before.clear()
        return self._until_the_end(rows[rows["tick"] >= self.trigger_tick - self._pre])

    def _until_the_end(self, rows: np.ndarray) -> tuple[np.ndarray, bool]:
        assert self.trigger_tick is not None
        past = rows["tick"] - self.trigger_tick
        self.done = bool(past[-1] >= self._length - 1)
        return rows[past < self._length], self.done

    def _hold(self, rows: np.ndarray) -> None:
        self._before.append(rows)
        oldest = int(rows["tick"][-1]) + 1 - self._pre  # the trigger comes in the next row at the earliest
        while self._before and self._before[0]["tick"][-1] < oldest:
            self._before.popleft()
