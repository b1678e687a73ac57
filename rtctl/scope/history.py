"""The newest seconds of every signal, by the number of the row."""

from collections.abc import Mapping

import numpy as np

MOST_ROWS = 300_000  # 30 s at 10 kHz
MOST_SECONDS = 120.0


class History:
    """Rows of the dtype `row`, at most `capacity` of them, numbered from 0 as they came.

    `head` is the number of the next row, `first` that of the oldest still there, `lost` how many the sender's `tick`
    says are missing between those that came.
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
        """Further signals beside those of the rows, 0 in the rows that are there."""
        new = tuple(name for name in names if name not in self.index)
        self.names += new
        self.index = {name: i for i, name in enumerate(self.names)}
        self._kept = np.concatenate((self._kept, np.zeros((len(new), self.capacity))))

    def append(self, rows: np.ndarray, beside: Mapping[str, np.ndarray] | None = None) -> None:
        """Take in rows, oldest first, and the values (n,) of the signals `beside` them."""
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
        """Rows `first` to `last` (not included), as far as they are there: an array (names, rows)."""
        first, last = max(first, self.first), min(last, self.head)
        which = [self.index[name] for name in names]
        if first >= last:
            return np.empty((len(which), 0))
        begin, end = first % self.capacity, (last - 1) % self.capacity + 1
        if begin < end:
            return self._kept[which, begin:end]
        return np.concatenate((self._kept[which, begin:], self._kept[which, :end]), axis=1)
