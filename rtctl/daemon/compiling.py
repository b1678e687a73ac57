"""Progress of the compilation in a child process, reported to its supervisor."""

import time
from typing import Any

from numba.core import event

from rtctl.daemon import child

EVERY = 1.0  # s between two reports


class _Listener(event.Listener):
    """Reports the name of a function whose compilation begins, at most once in EVERY s."""

    def __init__(self) -> None:
        self._last = 0.0

    def on_start(self, event: Any) -> None:
        now = time.monotonic()
        if now - self._last >= EVERY:
            self._last = now
            function = getattr(event.data.get("dispatcher"), "py_func", None)
            child.report("compiling", what=getattr(function, "__name__", "a step"))

    def on_end(self, event: Any) -> None:
        """No report: the next start of a compilation implies this end."""


def tell() -> None:
    """Report the compilations of this process from now on."""
    event.register("numba:compile", _Listener())
