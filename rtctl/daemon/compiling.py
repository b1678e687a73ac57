"""What a child compiles, told to its supervisor while it does so."""

import time
from typing import Any

from numba.core import event

from rtctl.daemon import child

EVERY = 1.0  # s between two reports


class _Listener(event.Listener):
    """Names of functions whose compilation begins."""

    def __init__(self) -> None:
        self._last = 0.0

    def on_start(self, event: Any) -> None:
        now = time.monotonic()
        if now - self._last >= EVERY:
            self._last = now
            function = getattr(event.data.get("dispatcher"), "py_func", None)
            child.report("compiling", what=getattr(function, "__name__", "a step"))

    def on_end(self, event: Any) -> None:
        """Nothing: the next beginning says enough."""


def tell() -> None:
    """Report from now on what this process compiles."""
    event.register("numba:compile", _Listener())
