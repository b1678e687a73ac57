"""What a child process does that records until it is killed. Imported by that process, so little is imported here."""

import os
from pathlib import Path

from trace_rows import CASE, COLUMNS, ROW, make

from rtctl.trace.recorder import Recorder
from rtctl.trace.rotation import Rotation

FINISHING = -1


def feed(announce, folder: Path, total: int, size: int, rotation: Rotation | None) -> None:
    """Give `total` rows to a recorder, `size` at a time, each batch when the one before is written; then finish.

    Sends how many rows it will have given, before it gives them.
    """
    recorder = Recorder(folder, COLUMNS, ROW, CASE, rotation=rotation)
    for first in range(0, total, size):
        announce.send(first + size)
        recorder.put(make(first, size))
        while recorder.stats().rows_queued:
            os.sched_yield()
    announce.send(FINISHING)
    recorder.finish()
