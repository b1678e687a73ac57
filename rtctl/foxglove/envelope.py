"""Thinned rows with extremes: of each `every` rows the newest, and the lowest and highest value of each signal."""

from typing import NamedTuple

import numpy as np

CLOCKS = ("tick", "t")  # columns with the value of the newest row, in all three arrays


class Thinned(NamedTuple):
    """Three structured arrays (n,); `low` and `high` are empty where no row was left out."""

    newest: np.ndarray
    low: np.ndarray
    high: np.ndarray


class Envelope:
    """Thins rows to one of `every`; rows of an incomplete group wait for the next call."""

    def __init__(self, every: int):
        if every < 1:
            raise ValueError(f"every is {every}; it must be at least 1")
        self.every = every
        self._rest: np.ndarray | None = None

    def feed(self, rows: np.ndarray) -> Thinned:
        """Thinned rows (structured, oldest first); an extreme is NaN only where all values are NaN."""
        if self.every == 1:
            return Thinned(rows, rows[:0], rows[:0])
        if self._rest is not None and len(self._rest):
            rows = np.concatenate((self._rest, rows))
        whole = len(rows) // self.every * self.every
        self._rest = rows[whole:].copy()
        newest = rows[self.every - 1 : whole : self.every]
        low, high = newest.copy(), newest.copy()
        for name in rows.dtype.names or ():
            if name not in CLOCKS:
                table = rows[name][:whole].reshape(-1, self.every)
                low[name], high[name] = np.fmin.reduce(table, axis=1), np.fmax.reduce(table, axis=1)
        return Thinned(newest, low, high)
