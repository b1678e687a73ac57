"""The newest seconds of every signal, by the number of the row."""

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

    def append(self, rows: np.ndarray) -> None:
        """Take in rows, oldest first."""
        if not len(rows):
            return
        if "tick" in self.index:
            tick = rows["tick"].astype(np.int64)
            steps = np.diff(tick, prepend=tick[0] - 1 if self._tick is None else self._tick)
            self.lost += int(np.maximum(steps - 1, 0).sum())
            self._tick = int(tick[-1])
        rows, self.head = rows[-self.capacity :], self.head + len(rows)
        end = self.head % self.capacity or self.capacity
        begin = end - len(rows)
        for kept, name in zip(self._kept, self.names, strict=True):
            values = rows[name]
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
