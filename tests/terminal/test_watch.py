"""`rtctl status --watch`: a moving machine, a lost and returning daemon, and Ctrl-C."""

import io

import pytest
from rich.console import Console

from rtctl.daemon.client import Client
from rtctl.terminal import watch
from rtctl.terminal.watch import Watch


@pytest.fixture(scope="module")
def machine(served, config):
    machine = served(config("ivu"))
    machine.run(0.1)
    return machine


@pytest.fixture
def script(monkeypatch):
    """`script(step, ...)`: each pause of the watch runs the next step; the last pause is Ctrl-C."""

    def make(*steps):
        left = iter(steps)

        def sleep(seconds):
            step = next(left, None)
            if step is None:
                raise KeyboardInterrupt
            step()

        monkeypatch.setattr(watch.time, "sleep", sleep)

    return make


@pytest.fixture
def watched(machine):
    """`watched(console)` watches until the script ends; returns the output."""

    def run(**options):
        file = io.StringIO()
        with Client(machine.endpoint) as client:
            Watch(client, client.call("status"), Console(file=file, width=120, **options)).run(0.1)
        return file.getvalue()

    return run


def test_lost_and_returning_daemon_are_reported_in_lines(machine, script, watched):
    script(lambda: machine.run(0.1), machine.stop, lambda: None, lambda: None, machine.start, lambda: machine.run(0.1))
    lines = watched().splitlines()
    assert all(line.isprintable() for line in lines)
    gone = [n for n, line in enumerate(lines) if "has ended; waiting" in line]
    back = [n for n, line in enumerate(lines) if "is back (pid" in line]
    assert len(gone) == len(back) == 1  # reported once
    assert gone[0] == 2 and back[0] > gone[0]  # between them there may be a daemon that does not answer yet


def test_lost_and_returning_daemon_are_shown_in_the_panel(machine, script, watched):
    script(machine.stop, lambda: None, machine.start, lambda: machine.run(0.1))
    shown = watched(force_terminal=True, color_system=None, _environ={"TERM": "xterm"})
    assert "has ended; waiting for it to come back" in shown
    assert shown.rindex("idle") > shown.rindex("has ended")
    assert shown.endswith("\x1b[?25h")  # the cursor is back


def test_changed_limit_is_shown(machine, script, watched):
    def change():
        with Client(machine.endpoint) as client:
            client.call("set", path="law.limit.high", value=7.5)
        machine.run(0.1)

    script(change)
    shown = watched(force_terminal=True, color_system=None, _environ={"TERM": "xterm"})
    assert "±10" in shown and "±7.5" in shown


def test_watch_without_access_to_the_ring_samples_the_status(machine, script, watched, monkeypatch):
    monkeypatch.setattr("rtctl.terminal.traces.Tap", lambda ring: (_ for _ in ()).throw(PermissionError()))
    script(lambda: machine.run(0.1))
    assert ", sampled" in watched(force_terminal=True, color_system=None, _environ={"TERM": "xterm"})
