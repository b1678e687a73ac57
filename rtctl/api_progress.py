"""Progress of a diagnosis where a person waits: a bar in a notebook or on a terminal, nothing in a script's pipe."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

Stage = Callable[[str], None]
BAR = "<progress value='{share:.3f}' max='1' style='width:16em'></progress> {seconds:.0f} s &ensp;{text}"


@contextmanager
def stages(wanted: bool | Stage) -> Iterator[Stage]:
    """Gives a function to call with each stage; `wanted` is whether to show it, or such a function itself."""
    if callable(wanted):
        yield wanted
    elif not wanted:
        yield lambda _: None
    elif display := _notebook():
        with _html(display) as show:
            yield show
    elif sys.stderr.isatty():
        from rtctl.cli.diagnose_console import DiagnoseConsole

        with DiagnoseConsole(False).stages() as show:
            yield show
    else:
        yield lambda _: None


def _notebook() -> Any:
    """IPython.display where this runs in a notebook's kernel, None elsewhere."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if shell is None or not hasattr(shell, "kernel"):
        return None
    import IPython.display

    return IPython.display


@contextmanager
def _html(display: Any) -> Iterator[Stage]:
    """A bar in the cell's output, which goes away at the end."""
    from rtctl.cli.diagnose_console import onward

    began, done = time.monotonic(), 0.0
    handle = display.display(display.HTML(""), display_id=True)

    def show(text: str) -> None:
        nonlocal done
        done = onward(done, text)
        words = BAR.format(share=done, seconds=time.monotonic() - began, text=escape(text))
        handle.update(display.HTML(words))

    try:
        yield show
    finally:
        handle.update(display.HTML(""))
