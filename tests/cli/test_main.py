import subprocess
import sys

import pytest

from rtctl import __version__
from rtctl.cli import common
from rtctl.cli.main import COMMANDS

GROUPS = {
    "trace": ("info", "plot", "repair", "export", "compare"),
    "keys": ("new",),
    "fault": ("add", "list", "clear", "table"),
    "campaign": ("run", "list"),
    "identify": ("frf", "multisine", "fit", "friction", "radius", "driver", "scale", "steps"),
}
LEAVES = [(c,) for c in COMMANDS if c not in GROUPS] + [(g, c) for g, commands in GROUPS.items() for c in commands]


@pytest.mark.parametrize("command", LEAVES, ids=" ".join)
def test_every_help_has_examples_that_start_with_the_command(rtctl, command):
    code, out, _ = rtctl(*command, "--help")
    assert code == 0
    assert f"rtctl {' '.join(command)}" in out.split("Examples:")[1]


def test_help_lists_the_commands_in_order(rtctl):
    code, out, _ = rtctl("--help")
    assert code == 0
    listed = [line.strip("│ ").split()[0] for line in out.splitlines() if line.startswith("│ ") and line[2].isalpha()]
    assert listed == list(COMMANDS)


def test_rtctl_without_a_command_shows_the_help(rtctl):
    code, out, err = rtctl()
    assert (code, err) == (2, "")
    assert "Usage: rtctl" in out


def test_version_is_printed(rtctl):
    assert rtctl("--version") == (0, f"rtctl {__version__}\n", "")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["statsu"], "no command 'statsu'; did you mean 'status'?"),
        (["qqq"], "no command 'qqq'; see rtctl --help"),
        (["run"], "missing argument 'CONFIG'; see rtctl run --help"),
        (["run", "ivu", "--lnik", "shm"], "no such option: --lnik"),
        (["check", "ivu", "ldu"], "got unexpected extra argument"),
        (["capture"], "missing option '--for'"),
        (["trace", "inof"], "no such command 'inof'"),
        (["--verbose"], "no such option: --verbose"),
    ],
)
def test_command_line_mistakes_are_one_line_and_exit_code_2(rtctl, words, message):
    code, out, err = rtctl(*words)
    assert (code, out) == (2, "")
    assert err.startswith(f"rtctl: {message}")
    assert err.count("\n") == 1


def test_internal_error_is_exit_code_1(rtctl, monkeypatch):
    def broken(_):
        raise RuntimeError("boom")

    monkeypatch.setattr(common, "client", broken)
    code, _, err = rtctl("status")
    assert code == 1
    assert err == "rtctl: internal error: RuntimeError('boom'); RTCTL_TRACEBACK=1 shows where\n"


def test_interrupt_is_exit_code_130(rtctl, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(common, "client", interrupted)
    assert rtctl("status").code == 130


@pytest.mark.parametrize(
    "words", [["--help"], ["status", "--name", "tcp://127.0.0.1:1"], ["run", "--help"]], ids=" ".join
)
def test_start_imports_nothing_heavy(words, tmp_path):
    program = f"""
import sys
from rtctl.cli.main import main
main({words})
heavy = {{"numba", "scipy", "pyarrow", "matplotlib", "pint", "control", "rtctl.machines"}} & set(sys.modules)
sys.exit(", ".join(heavy) or 0)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_closed_output_pipe_is_not_a_crash():
    process = subprocess.Popen(
        [sys.executable, "-m", "rtctl.cli.main", "schema", "ivu"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.close()
    with process.stderr:
        assert b"Traceback" not in process.stderr.read()
    assert process.wait() == 1
