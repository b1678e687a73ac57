"""The ring buffer of trace rows from the loop to the supervisor: one writer, one reader, no waiting.

The writer overwrites the oldest rows, so that the newest seconds survive the death of the reader. The reader counts
overwritten rows. Rows are numbered from 0, so rows written = rows read + rows lost, exactly.
"""

import numpy as np

from rtctl.idiom import state, tick
from rtctl.tick.memory import Segment, release

RING = state(
    head=int,  # rows written; the loop writes it
    tail=int,  # rows that the reader has taken or lost; the supervisor writes it
)


@tick
def put(ring, rows, row):
    """Append the record `row[0]`; allocates nothing."""
    rows[ring.head % rows.shape[0]] = row[0]
    release()  # the row is complete before the head counts it
    ring.head += 1


class Reader:
    """The supervisor's end of the ring. `take()` returns a copy of the new rows; `lost` counts overwritten rows."""

    def __init__(self, segment: Segment):
        self._ring = segment["ring"][0]
        self._rows = segment["rows"]
        self.lost = 0
        self.gaps: list[tuple[int, int]] = []  # (first row lost, how many) since the last take

    def take(self, most: int | None = None) -> np.ndarray:
        """New rows (n,), oldest first, at most `most`; rows lost before them are in `gaps`."""
        capacity = len(self._rows)
        head, tail = int(self._ring["head"]), int(self._ring["tail"])
        self.gaps = []
        first = max(tail, head - capacity)
        last = head if most is None else min(head, first + most)
        begin, end = first % capacity, last % capacity
        if first == last or begin < end:
            rows = self._rows[begin : begin + last - first].copy()
        else:
            rows = np.concatenate((self._rows[begin:], self._rows[:end]))
        torn = int(self._ring["head"]) - capacity + 1  # earlier rows may have been overwritten during the copy
        if torn > first:
            skip = min(torn, last) - first
            rows, first = rows[skip:], first + skip
        if first > tail:
            self.gaps.append((tail, first - tail))
            self.lost += first - tail
        self._ring["tail"] = last
        return rows
