"""A closed terminal ends the run: disarmed and fully recorded. A run with losses reports them."""

import fcntl
import json
import os
import pty
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from rtctl.trace.bundle import load_bundle

RUN = [sys.executable, "-m", "rtctl.cli.main", "run", "ivu", "--no-plot"]


def _at_a_terminal() -> None:
    """In the new process: standard input is its terminal, and hangs up as one does, though the tests run by nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


@pytest.mark.realtime
def test_closed_terminal_disarms_and_ends_the_recording(runtime: Path, tmp_path: Path) -> None:
    master, slave = pty.openpty()
    out = tmp_path / "run"
    sets = ["--set", f"name=hup{os.getpid()}", "--set", "loop.realtime=off", "--set", "safety.missed_ticks=0"]
    run = subprocess.Popen(
        [*RUN, "--mode", "real", "--link", "shm", "--out", str(out), *sets, "--set", "safety.link_timeout=10"],
        stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
        preexec_fn=_at_a_terminal,
    )  # fmt: skip
    os.close(slave)
    shown, deadline = b"", time.monotonic() + 240
    os.set_blocking(master, False)
    while b"running" not in shown:
        assert run.poll() is None and time.monotonic() < deadline, shown.decode(errors="replace")
        try:
            shown += os.read(master, 65536)
        except BlockingIOError:
            time.sleep(0.02)
    os.close(master)  # the kernel sends SIGHUP to the session; writes to the terminal fail
    run.wait(60)
    assert run.returncode == 129
    trace = load_bundle(out)
    ticks = trace.columns["tick"]
    assert not trace.case["run"]["trip"] and (trace.columns["state"] == 2).any()
    assert trace.case["run"]["ticks"] == len(ticks) == ticks[-1] + 1  # including the last tick, which sends zero


def test_missed_ticks_are_reported_and_fail_on_loss_sets_the_exit_code(tmp_path: Path) -> None:
    fault = "faults=[{fault: loop.stall, at: 0.5, lasts: 2 ms, size: 0.006}]"
    words = [*RUN, "--mode", "fused", "--for", "1s", "--set", fault, "--set", f"name=loss{os.getpid()}"]
    plain = subprocess.run([*words, "--out", tmp_path / "a"], capture_output=True, text=True, check=False)
    assert plain.returncode == 0 and "0 rows were lost and 3 ticks missed" in " ".join(plain.stderr.split())
    strict = subprocess.run(
        [*words, "--out", tmp_path / "b", "--json", "--fail-on-loss"], capture_output=True, text=True, check=False
    )
    assert strict.returncode == 1 and json.loads(strict.stdout)["missed"] == 3
