"""Rows that a recording does not have: how many, and which ticks."""

from typing import Any

import numpy as np

MOST_GAPS = 10_000  # listed; a disk that is too slow for days must not fill the memory with a list of gaps


class Losses:
    """Counts lost rows exactly and lists the gaps as (first tick, count), joined where one follows on the other."""

    def __init__(self) -> None:
        self.rows = 0
        self.unlisted = 0  # gaps beyond MOST_GAPS; their rows are counted
        self._gaps: list[list[int]] = []

    def add(self, first_tick: int, count: int) -> None:
        """`count` rows are lost from `first_tick` on."""
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
        """The rows with these ticks (rising) are lost."""
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
        """Those of the ticks from `first` to before `end`, as far as they are listed."""
        found = Losses()
        for tick, count in self.gaps:
            start = max(tick, first)
            found.add(start, min(tick + count, end) - start)
        return found

    def as_dict(self) -> dict[str, Any]:
        """What case.json says under "losses"."""
        told: dict[str, Any] = {"rows": self.rows, "gaps": self.gaps}
        if self.unlisted:
            told["unlisted_gaps"] = self.unlisted
        return told
