"""A tap: one more reader of the ring, in any process of the same user on the same machine.

It sees every row of the trace at the loop's own rate, and nobody sees the tap: it maps the ring for reading alone,
moves no counter, and neither the loop nor the supervisor does anything for it. Whoever reads too late loses rows and is
told how many, as the supervisor is.

`signals` of the command socket says where the ring is. A daemon of another machine or user has none for us.
"""

import mmap
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.tick.memory import Segment


def describe(segment: Segment) -> dict[str, Any]:
    """Where a tap finds the ring of a segment: file, offsets in bytes, length in rows, and the type of a row."""
    base = segment["status"].ctypes.data  # the first record of a segment, see loop.records.layout
    ring, rows = segment["ring"][0], segment["rows"]
    head, tail = (segment["ring"].ctypes.data + ring.dtype.fields[name][1] - base for name in ("head", "tail"))
    return {
        "path": str(segment.path),
        "inode": segment.path.stat().st_ino,
        "head": head,
        "tail": tail,
        "rows": rows.ctypes.data - base,
        "capacity": len(rows),
        "fields": [[name, rows.dtype[name].str] for name in rows.dtype.names],
    }


class Tap:
    """Rows of a running machine from now on, as structured arrays; `lost` counts those that came and went unseen.

    `Tap(client.call("signals")["ring"])`. Raises OSError where the ring is not on this machine, not ours to read, or
    belongs to a daemon that has been started since.
    """

    def __init__(self, ring: dict[str, Any]):
        path = Path(ring["path"])
        fd = os.open(path, os.O_RDONLY)
        try:
            if os.fstat(fd).st_ino != ring["inode"]:
                raise FileNotFoundError(f"{path} is of another daemon by now")
            self._map = mmap.mmap(fd, 0, access=mmap.ACCESS_READ)
        finally:
            os.close(fd)
        dtype = np.dtype([(name, kind) for name, kind in ring["fields"]], align=True)
        self._head = np.frombuffer(self._map, np.int64, 1, ring["head"])
        self._tail = np.frombuffer(self._map, np.int64, 1, ring["tail"])
        self._rows = np.frombuffer(self._map, dtype, ring["capacity"], ring["rows"])
        self.names: tuple[str, ...] = dtype.names or ()
        self.lost = 0
        self._at = int(self._head[0])  # rows passed

    @property
    def filled(self) -> float:
        """Share of the ring that waits for the supervisor, 0 to 1; at 1 rows are lost."""
        return min((int(self._head[0]) - int(self._tail[0])) / len(self._rows), 1.0)

    def take(self, names: Sequence[str] | None = None) -> np.ndarray:
        """New rows, oldest first, copied; only the fields `names` if given."""
        capacity = len(self._rows)
        head = int(self._head[0])
        first = max(self._at, head - capacity)
        names = self.names if names is None else names
        taken = np.empty(head - first, [(name, self._rows.dtype[name]) for name in names])
        begin, end = first % capacity, head % capacity
        pieces = [slice(begin, end)] if begin < end else [slice(begin, None), slice(0, end)]
        if first == head:
            return taken
        for name in names:
            taken[name] = np.concatenate([self._rows[name][piece] for piece in pieces])
        torn = int(self._head[0]) - capacity + 1  # rows below may have been overwritten while they were copied
        skip = min(max(torn - first, 0), head - first)
        self.lost += first + skip - self._at
        self._at = head
        return taken[skip:]
