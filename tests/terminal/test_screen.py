"""Live display below scrolling lines; a slow terminal does not block."""

import io
import os
import threading

import pyte
from rich.console import Console
from rich.text import Text

from rtctl.terminal.screen import Screen, takes_pictures


def seen(data, columns=60, rows=20):
    """Lines shown by a terminal after `data`."""
    screen = pyte.Screen(columns, rows)
    pyte.Stream(screen).feed(data.replace("\n", "\r\n"))
    return [line.rstrip() for line in screen.display]


def test_messages_and_log_lines_stay_and_the_display_is_cleared():
    file = io.StringIO()
    console = Console(file=file, force_terminal=True, width=60)
    with Screen(console, "starting") as screen:
        for n in range(5):
            screen.show(Text(f"picture {n}\nof two lines"))
            screen.say(Text(f"said {n}"))
            print(f"\x1b[31mlogged {n}\x1b[0m", file=screen, flush=True)
    lines = [line for line in seen(file.getvalue()) if line]
    assert lines == [f"{what} {n}" for n in range(5) for what in ("said", "logged")]
    assert "\x1b[?25h" in file.getvalue()  # the cursor is back


def test_blocked_terminal_does_not_block_the_program():
    read_end, write_end = os.pipe()
    file = os.fdopen(write_end, "w")
    console = Console(file=file, force_terminal=True, width=200)
    showed = threading.Event()

    def show():
        screen = Screen(console)
        screen.__enter__()
        for n in range(2000):  # far more than a pipe holds
            screen.show(Text(f"{n} " * 500))
            screen.say(Text(f"{n} " * 500))
        showed.set()

    threading.Thread(target=show, daemon=True).start()
    assert showed.wait(60)
    os.close(read_end)  # the drawing thread ends with a broken pipe


def test_only_capable_terminals_get_a_live_display(monkeypatch):
    assert takes_pictures(Console(force_terminal=True, file=io.StringIO(), _environ={"TERM": "xterm"}))
    assert not takes_pictures(Console(file=io.StringIO()))
    monkeypatch.setenv("TERM", "dumb")
    assert not takes_pictures(Console(force_terminal=True, file=io.StringIO()))
