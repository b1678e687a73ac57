"""Spectra of the newest rows, each computed once for all viewers that show it in a frame."""

import numpy as np

from rtctl.scope.history import History
from rtctl.scope.reduce import LONGEST_SPECTRUM, in_columns, lines


class Spectra:
    """Fourier transforms shared by the viewers. Only the columns, which cost little, depend on a viewer's width."""

    def __init__(self) -> None:
        self._of: History | None = None
        self._head = 0
        self._lines: dict[tuple[str, int], np.ndarray] = {}  # of the newest rows, by signal and first row

    def newest(
        self, history: History, names: list[str], rows: int, dt: float, columns: int
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Frequencies (points,) in Hz and amplitudes (signals, points) of the newest `rows`, and the number of rows
        used; see `spectrum`."""
        if history is not self._of or history.head != self._head:
            self._of, self._head = history, history.head
            self._lines.clear()
        first = max(history.head - min(rows, LONGEST_SPECTRUM), history.first)
        new = [name for name in names if (name, first) not in self._lines]
        found = lines(history.take(tuple(new), first, history.head))
        self._lines |= {(name, first): squared for name, squared in zip(new, found, strict=True)}
        there = history.head - first
        squared = np.stack([self._lines[name, first] for name in names]) if names else np.empty((0, there // 2))
        return *in_columns(squared, there, dt, columns), there
