"""Peaks of a signal over the last seconds, and their sparkline.

A bar shows the largest value of its interval, so that one bad tick of ten thousand is visible.
"""

import itertools

import numpy as np

WINDOW = 30.0  # s of the machine's clock
STRETCH = 0.1  # s, interval of the finest bar
BARS = " ▁▂▃▄▅▆▇█"
ASCII_BARS = " .:-=+*#@"


class Peaks:
    """The largest magnitude in each `STRETCH` of the last `WINDOW` of the machine's clock; NaN where none is known."""

    def __init__(self) -> None:
        self._peaks = np.full(round(WINDOW / STRETCH), np.nan)
        self._newest = -1  # number of the newest interval, counted from t = 0

    def feed(self, t: np.ndarray, values: np.ndarray) -> None:
        """Add `values` at the times `t`, s, oldest first; non-finite values are skipped."""
        size = np.abs(np.asarray(values, float))
        known = np.isfinite(size) & np.isfinite(t)
        if not known.any():
            return
        stretch = np.floor(np.asarray(t, float)[known] / STRETCH + 1e-6).astype(np.int64)
        last = int(stretch[-1])
        if last < self._newest:  # the clock of a restarted machine
            self.clear()
        kept = stretch > last - len(self._peaks)
        fresh = np.arange(max(self._newest + 1, last - len(self._peaks) + 1), last + 1)
        self._peaks[fresh % len(self._peaks)] = np.nan
        self._newest = last
        slots = stretch[kept] % len(self._peaks)
        edges = np.flatnonzero(np.diff(slots, prepend=-1))
        tops = np.maximum.reduceat(size[known][kept], edges)
        self._peaks[slots[edges]] = np.fmax(self._peaks[slots[edges]], tops)

    def clear(self) -> None:
        self._peaks[:] = np.nan
        self._newest = -1

    @property
    def peak(self) -> float:
        """Largest peak of the window; NaN where none is known."""
        return float(np.fmax.reduce(self._peaks))

    def bars(self, count: int) -> np.ndarray:
        """The window as `count` peaks, oldest first, (count,) or fewer; NaN where none is known."""
        if self._newest < 0:
            return np.full(count, np.nan)
        ordered = np.roll(self._peaks, -(self._newest + 1) % len(self._peaks))
        edges = np.linspace(0, len(ordered), count + 1).round().astype(int)
        if count >= len(ordered):
            return ordered
        return np.array([np.fmax.reduce(ordered[a:b]) for a, b in itertools.pairwise(edges)])


def sparkline(values: np.ndarray, top: float, ascii_only: bool = False) -> str:
    """Text with one character a value: `top` is a full bar, NaN a blank, any other value at least the lowest bar."""
    bars = ASCII_BARS if ascii_only else BARS
    scale = (len(bars) - 2) / top if top > 0 else 0.0
    return "".join(bars[0] if v != v else bars[1 + min(int(v * scale + 0.5), len(bars) - 2)] for v in values)
