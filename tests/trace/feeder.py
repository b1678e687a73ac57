"""Body of a child process that records until it is killed. Few imports: the child process imports this module."""

import os
from pathlib import Path

from trace_rows import CASE, COLUMNS, ROW, make

from rtctl.trace.recorder import Recorder
from rtctl.trace.rotation import Rotation

FINISHING = -1


def feed(announce, folder: Path, total: int, size: int, rotation: Rotation | None) -> None:
    """Put `total` rows into a recorder in batches of `size`, each after the previous batch is written; then finish.

    Sends the number of rows after each batch before the batch is put.
    """
    recorder = Recorder(folder, COLUMNS, ROW, CASE, rotation=rotation)
    for first in range(0, total, size):
        announce.send(first + size)
        recorder.put(make(first, size))
        while recorder.stats().rows_queued:
            os.sched_yield()
    announce.send(FINISHING)
    recorder.finish()
