"""A tap: read-only access to the ring from any process of the same user on the same computer.

A tap sees every row of the trace at the loop's rate. It maps the ring read-only and moves no counter, so it costs the
loop and the supervisor nothing. A tap that reads too late loses rows and counts them.

`signals` of the command socket returns the place of the ring. Other users and computers have no access to it.
"""

import mmap
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.tick.memory import Segment


def describe(segment: Segment) -> dict[str, Any]:
    """Place of a segment's ring for a tap: file, offsets in bytes, length in rows, and fields of a row."""
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
    """Rows of a running machine from now on, as structured arrays; `lost` counts rows that were overwritten unread.

    `Tap(client.call("signals")["ring"])`. Raises OSError where the ring is not on this computer, is not readable for
    this user, or belongs to a later daemon.
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
        """Fraction of the ring, 0 to 1, with rows that the supervisor has not read; at 1 rows are lost."""
        return min((int(self._head[0]) - int(self._tail[0])) / len(self._rows), 1.0)

    def take(self, names: Sequence[str] | None = None) -> np.ndarray:
        """Copy of the new rows (n,), oldest first; only the fields `names` if given."""
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
        torn = int(self._head[0]) - capacity + 1  # earlier rows may have been overwritten during the copy
        skip = min(max(torn - first, 0), head - first)
        self.lost += first + skip - self._at
        self._at = head
        return taken[skip:]
