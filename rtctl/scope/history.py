"""History of the newest rows of every signal, addressed by row number."""

from collections.abc import Mapping

import numpy as np

MOST_ROWS = 300_000  # rows kept, 30 s at 10 kHz
MOST_SECONDS = 120.0  # s of rows kept


class History:
    """Circular buffer of at most `capacity` rows of dtype `row`, numbered from 0 in order of arrival.

    `head` is the number of the next row, `first` the number of the oldest row kept. `lost` counts missing rows, from
    jumps of `tick`.
    """

    def __init__(self, row: np.dtype, capacity: int):
        self.names = tuple(row.names or ())
        self.index = {name: i for i, name in enumerate(self.names)}
        self.capacity = capacity
        self.head = 0
        self.lost = 0
        self._kept = np.empty((len(self.names), capacity))
        self._tick: int | None = None

    @property
    def first(self) -> int:
        return max(0, self.head - self.capacity)

    def extend(self, names: tuple[str, ...]) -> None:
        """Add signals that are not in the rows; they are 0 in the rows so far."""
        new = tuple(name for name in names if name not in self.index)
        self.names += new
        self.index = {name: i for i, name in enumerate(self.names)}
        self._kept = np.concatenate((self._kept, np.zeros((len(new), self.capacity))))

    def append(self, rows: np.ndarray, beside: Mapping[str, np.ndarray] | None = None) -> None:
        """Append rows (n,), oldest first, and values (n,) of the added signals in `beside`."""
        if not len(rows):
            return
        if "tick" in self.index:
            tick = rows["tick"].astype(np.int64)
            steps = np.diff(tick, prepend=tick[0] - 1 if self._tick is None else self._tick)
            self.lost += int(np.maximum(steps - 1, 0).sum())
            self._tick = int(tick[-1])
        beside = {name: values[-self.capacity :] for name, values in (beside or {}).items()}
        rows, self.head = rows[-self.capacity :], self.head + len(rows)
        end = self.head % self.capacity or self.capacity
        begin = end - len(rows)
        for kept, name in zip(self._kept, self.names, strict=True):
            values = beside[name] if name in beside else rows[name]
            if begin >= 0:
                kept[begin:end] = values
            else:
                kept[begin:] = values[:-end]
                kept[:end] = values[-end:]

    def take(self, names: tuple[str, ...], first: int, last: int) -> np.ndarray:
        """Array (names, rows) of the rows `first` to `last` (not included), as far as they are kept."""
        first, last = max(first, self.first), min(last, self.head)
        which = [self.index[name] for name in names]
        if first >= last:
            return np.empty((len(which), 0))
        begin, end = first % self.capacity, (last - 1) % self.capacity + 1
        if begin < end:
            return self._kept[which, begin:end]
        return np.concatenate((self._kept[which, begin:], self._kept[which, :end]), axis=1)
