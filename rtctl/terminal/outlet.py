"""A stream whose reader may go: a terminal that is closed (EIO), or a pipe (EPIPE). Writing to it never raises."""

import contextlib
import os
from typing import Any


class Outlet:
    """Passes on to `stream` for as long as it takes anything; `gone` says that it does not any more."""

    def __init__(self, stream: Any):
        self._stream = stream
        self.gone = False

    def write(self, text: str) -> int:
        """Write, or drop where nobody is there."""
        try:
            return len(text) if self.gone else int(self._stream.write(text))
        except (OSError, ValueError):  # ValueError: it was closed here
            self._lose()
            return len(text)

    def flush(self) -> None:
        try:
            if not self.gone:
                self._stream.flush()
        except (OSError, ValueError):  # ValueError: it was closed here
            self._lose()

    def _lose(self) -> None:
        self.gone = True
        with contextlib.suppress(OSError, ValueError):  # what waits in the buffer would fail again at exit
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
