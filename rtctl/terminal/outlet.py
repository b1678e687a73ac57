"""Stream whose reader may disappear: a closed terminal (EIO) or pipe (EPIPE). Writing to it never raises."""

import contextlib
import os
from typing import Any


class Outlet:
    """Writer to `stream`; after the first failed write `gone` is true and text is dropped."""

    def __init__(self, stream: Any):
        self._stream = stream
        self.gone = False

    def write(self, text: str) -> int:
        """Write the text, or drop it where the reader is gone; returns the number of characters."""
        try:
            return len(text) if self.gone else int(self._stream.write(text))
        except (OSError, ValueError):  # ValueError: the stream is closed
            self._lose()
            return len(text)

    def flush(self) -> None:
        try:
            if not self.gone:
                self._stream.flush()
        except (OSError, ValueError):  # ValueError: the stream is closed
            self._lose()

    def _lose(self) -> None:
        self.gone = True
        with contextlib.suppress(OSError, ValueError):  # else the buffer would fail again at exit
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
