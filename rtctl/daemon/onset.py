"""An emulated machine that becomes another one in mid-run: the same state goes on under other equations."""

import threading
from typing import Any

import numpy as np

from rtctl.daemon.plant_process import Plant


def carry(source: Any, target: Any) -> None:
    """Copy the fields that two records have in common, by name and type, records within records alike."""
    for name in target.dtype.names or ():
        if name not in (source.dtype.names or ()):
            continue
        if target.dtype[name].names:
            carry(source[name], target[name])
        elif source.dtype[name] == target.dtype[name]:
            target[name] = source[name]


class Onset:
    """Emulates `first`, and `seconds` after that began `second`, which goes on from its state. On the wall clock."""

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
