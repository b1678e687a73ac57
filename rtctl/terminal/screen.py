"""Picture at the bottom of the terminal, with messages and log lines scrolling above it.

A separate thread draws only the newest picture: a terminal that is stopped with Ctrl-S or slow loses pictures and never
delays the caller.
"""

import contextlib
import threading
from collections import deque
from types import TracebackType
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.text import Text

PATIENCE = 2.0  # s, longest wait at the end for a blocked terminal
LINES = 1000  # lines kept for a blocked terminal; the oldest are dropped


def takes_pictures(console: Console) -> bool:
    """Whether the cursor can be moved: no pipe, no file, no TERM=dumb."""
    return console.is_terminal and not console.is_dumb_terminal


class Screen:
    """Context of a picture, removed at the end; `show` and `say` return at once. As a file it takes log lines."""

    def __init__(self, console: Console, first: Any = ""):
        self._console = console
        self._changed = threading.Condition()  # guards the attributes below; never held while drawing
        self._picture = first
        self._fresh = False
        self._lines: deque[Text] = deque(maxlen=LINES)
        self._ended = False
        self._thread = threading.Thread(target=self._run, name="screen", daemon=True)

    def __enter__(self) -> "Screen":
        self._thread.start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join(PATIENCE)

    def show(self, picture: Any) -> None:
        """Replace the picture."""
        with self._changed:
            self._picture, self._fresh = picture, True
            self._changed.notify()

    def say(self, text: Text) -> None:
        """Print a line above the picture."""
        with self._changed:
            self._lines.append(text)
            self._changed.notify()

    def write(self, text: str) -> int:
        if line := text.rstrip("\n"):
            self.say(Text.from_ansi(line))
        return len(text)

    def flush(self) -> None:
        """Nothing to do: the thread prints all lines."""

    def _run(self) -> None:
        with contextlib.suppress(OSError, SystemExit):  # the terminal is gone; rich exits on a broken pipe
            self._draw()

    def _draw(self) -> None:
        console = self._console
        with Live(self._picture, console=console, auto_refresh=False, transient=True, redirect_stdout=False) as live:
            ended = False
            while not ended:
                with self._changed:
                    self._changed.wait_for(lambda: self._fresh or self._lines or self._ended)
                    ended, fresh, picture = self._ended, self._fresh, self._picture
                    lines, self._fresh = list(self._lines), False
                    self._lines.clear()
                for text in lines:
                    console.print(text, soft_wrap=True)
                if fresh:
                    live.update(picture, refresh=True)
