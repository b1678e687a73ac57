"""Lost rows of a recording: number and ticks."""

from typing import Any

import numpy as np

MOST_GAPS = 10_000  # listed gaps; bounds the memory where the disk is too slow for days


class Losses:
    """Exact count of lost rows, and list of gaps as (first tick, count); adjacent gaps are joined."""

    def __init__(self) -> None:
        self.rows = 0
        self.unlisted = 0  # number of gaps beyond MOST_GAPS; the rows of these gaps are counted
        self._gaps: list[list[int]] = []

    def add(self, first_tick: int, count: int) -> None:
        """Count `count` lost rows from `first_tick` on."""
        if count <= 0:
            return
        self.rows += int(count)
        last = self._gaps[-1] if self._gaps else None
        if last and last[0] + last[1] == first_tick:
            last[1] += int(count)
        elif len(self._gaps) < MOST_GAPS:
            self._gaps.append([int(first_tick), int(count)])
        else:
            self.unlisted += 1

    def add_ticks(self, ticks: np.ndarray) -> None:
        """Count the rows with these ticks (n,), rising, as lost."""
        if len(ticks):
            for run in np.split(ticks, np.flatnonzero(np.diff(ticks) != 1) + 1):
                self.add(run[0], len(run))

    @property
    def gaps(self) -> list[list[int]]:
        """[first tick, count] of every gap, in the order of time."""
        joined: list[list[int]] = []
        for first, count in sorted(self._gaps):  # the writer and the reader of the ring report out of order
            if joined and joined[-1][0] + joined[-1][1] == first:
                joined[-1][1] += count
            else:
                joined.append([first, count])
        return joined

    def between(self, first: int, end: int) -> "Losses":
        """Listed losses with ticks in [first, end)."""
        found = Losses()
        for tick, count in self.gaps:
            start = max(tick, first)
            found.add(start, min(tick + count, end) - start)
        return found

    def as_dict(self) -> dict[str, Any]:
        """Entry "losses" of case.json."""
        told: dict[str, Any] = {"rows": self.rows, "gaps": self.gaps}
        if self.unlisted:
            told["unlisted_gaps"] = self.unlisted
        return told
