"""Change of an emulated machine in mid-run: a second machine continues from the state of the first."""

import threading
from typing import Any

import numpy as np

from rtctl.daemon.plant_process import Plant


def carry(source: Any, target: Any) -> None:
    """Copy the fields with the same name and type from one record to another, also in nested records."""
    for name in target.dtype.names or ():
        if name not in (source.dtype.names or ()):
            continue
        if target.dtype[name].names:
            carry(source[name], target[name])
        elif source.dtype[name] == target.dtype[name]:
            target[name] = source[name]


class Onset:
    """Emulates `first`, then after `seconds` s of wall clock `second`, which continues from the state of `first`."""

    def __init__(self, first: Plant, second: Plant, seconds: float):
        self._first, self._second, self._seconds = first, second, seconds

    def run(self) -> None:
        """Emulate until status.stop is set."""
        status, due = self._first.status, threading.Event()

        def change() -> None:
            due.set()
            status["stop"] = 1

        timer = threading.Timer(self._seconds, change)
        timer.daemon = True
        timer.start()
        self._first.run()
        timer.cancel()
        if not due.is_set():
            return
        for before, after in zip(self._first.records, self._second.records, strict=True):
            carry(before, after)
        status["stop"] = status["ended"] = np.int64(0)
        self._second.run()
