"""`rtctl run` on a terminal, on a dumb terminal, and on a pipe."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios

import pyte
import pytest

COLUMNS, ROWS = 70, 24
LONG = "120s"  # six times the capacity of the ring: the supervisor needs many turns


def run(tmp_path, runtime, *words, **environment):
    """Output of a run of the reel unit on a terminal of COLUMNS x ROWS, and its exit code."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("4H", ROWS, COLUMNS, 0, 0))
    command = [sys.executable, "-m", "rtctl.cli.main", "run", "ivu", "--mode", "fused", "--for", LONG, "--no-plot"]
    command += ["--set", f"name=pty{os.getpid()}", "--out", str(tmp_path / "bundle"), *words]
    plain = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "NO_COLOR")}
    env = {**plain, "TERM": "xterm-256color", **environment}
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=env) as process:
        os.close(theirs)
        data = b""
        try:
            while block := os.read(ours, 65536):
                data += block
        except OSError:
            pass  # the other end is closed
        process.wait(60)
    os.close(ours)
    return process.returncode, data


def first(lines):
    """Index of the line of the summary that names the machine; above it stands which config runs, in as many lines as
    its path takes."""
    return next(k for k, line in enumerate(lines) if line.startswith(f"pty{os.getpid()}"))


def test_panel_is_replaced_by_a_summary(tmp_path, runtime):
    code, data = run(tmp_path, runtime, "--reference", "steps", NO_COLOR="1")
    assert code == 0
    assert b"|error|" in data  # the panel was shown
    assert not any(f"\x1b[{colour}m".encode() in data for colour in (31, 32, 41, 42))
    screen = pyte.Screen(COLUMNS, ROWS)
    pyte.ByteStream(screen).feed(data)
    lines = [line.rstrip() for line in screen.display]
    summary = first(lines)
    above = "".join(lines[:summary])
    assert above.startswith("config /") and above.replace(" ", "").endswith("ivu.yaml,whichcomeswithrtctl")
    assert lines[summary].startswith(f"pty{os.getpid()}  60000 ticks at 500 Hz, fused: 0 missed")
    assert lines[summary + 1].split()[:2] == ["t", "[s]"]
    assert any(line.startswith("bundle") for line in lines)
    assert not any("|error|" in line for line in lines)  # and is cleared
    assert not screen.cursor.hidden


def test_dumb_terminal_gets_plain_lines(tmp_path, runtime):
    code, data = run(tmp_path, runtime, TERM="dumb")
    assert code == 0
    assert b"\x1b[2K" not in data and b"\x1b[1A" not in data and b"\x1b[?25l" not in data
    assert b"missed 0" in data


@pytest.mark.parametrize("json", [False, True])
def test_pipe_gets_no_control_characters(rtctl, tmp_path, json):
    words = ["run", "ivu", "--mode", "fused", "--for", "1s", "--no-plot", "--out", tmp_path / "bundle"]
    code, out, err = rtctl(*words, "--set", f"name=pipe{os.getpid()}", *(["--json"] if json else []))
    assert code == 0
    assert (out[:1] == "{", len(out.splitlines())) == ((True, 1) if json else (False, 0))
    assert all(line.isprintable() for line in err.splitlines())
    assert ("missed" in err) is not json
