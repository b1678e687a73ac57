"""What the computer refuses has words; `internal error` is for mistakes of the program."""

import contextlib
import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
import zmq

from rtctl.cli.failures import ADVICE, words
from rtctl.cli.main import main

CALLS = ("open", "os.mkdir", "os.rename", "os.remove", "os.listdir", "os.scandir", "os.link", "os.truncate", "os.chmod")
FAULTS = (errno.ENOSPC, errno.EMFILE, errno.EACCES, errno.EPERM, errno.EISDIR, errno.EROFS, errno.EIO, errno.ENOENT)


class Refusing:
    """Of the calls to the system below a folder, the one with number `at` is refused with `number`."""

    def __init__(self) -> None:
        self.folder, self.at, self.number, self.count = "", -1, 0, 0
        sys.addaudithook(self)  # for good: a hook cannot be taken off, but does nothing without a folder

    def __call__(self, event: str, arguments: tuple) -> None:
        if not self.folder or event not in CALLS or not str(arguments[0]).startswith(self.folder):
            return
        self.count += 1
        if self.count == self.at:
            raise OSError(self.number, os.strerror(self.number), str(arguments[0]))

    @contextlib.contextmanager
    def within(self, folder: Path, at: int = -1, number: int = 0) -> Iterator["Refusing"]:
        self.folder, self.at, self.number, self.count = str(folder), at, number, 0
        yield self
        self.folder = ""


refusing = Refusing()


@pytest.mark.parametrize("number", ADVICE, ids=lambda number: errno.errorcode[number])
def test_each_refusal_names_the_path_and_what_to_do(number: int) -> None:
    said = words(OSError(number, os.strerror(number), "/data/run"))
    assert said is not None and said.startswith("/data/run: ") and said.endswith(ADVICE[number])


def test_refusals_behind_other_errors_are_found() -> None:
    try:
        try:
            raise OSError(errno.ENOSPC, "No space left on device")
        except OSError as error:
            raise RuntimeError("while it was written") from error
    except RuntimeError as error:
        assert words(error) == f"no space left on device; {ADVICE[errno.ENOSPC]}"
    assert "open files" in str(words(zmq.ZMQError(errno.EMFILE)))
    assert "killed" in str(words(BrokenProcessPool("a child process terminated abruptly")))
    assert "memory" in str(words(MemoryError()))


def test_mistakes_of_the_program_have_no_words() -> None:
    assert words(ValueError("x")) is None and words(OSError(errno.EINVAL, "Invalid argument")) is None


def log_of(folder: Path) -> Path:
    """A small log of an axis, as a logger writes it."""
    rows = (f"{k / 100},{k % 7 - 3},{k * k / 1e5}" for k in range(300))
    path = folder / "log.csv"
    path.write_text("t,u,x\n" + "\n".join(rows) + "\n")
    return path


COMMANDS = {
    "check": lambda log, out: ["check", str(Path(__file__).parents[2] / "configs" / "axis.yaml")],
    "import": lambda log, out: ["import", str(log), "--plant", "axis", "--parameter", "M=1", "-o", str(out / "made")],
    "new": lambda log, out: ["new", "law", str(out / "my_law.py")],
    "repair": lambda log, out: ["trace", "repair", str(log.parent / "bundle")],
    "export": lambda log, out: ["trace", "export", str(log.parent / "bundle"), "--to", "csv", "-o", str(out / "x.csv")],
    "metrics": lambda log, out: ["trace", "metrics", str(log.parent / "bundle")],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_call_to_the_system_may_be_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    log = log_of(tmp_path)
    assert main(["import", str(log), "--plant", "axis", "--parameter", "M=1", "-o", str(tmp_path / "bundle")]) == 0
    with refusing.within(tmp_path) as counted:
        main(COMMANDS[command](log, fresh(tmp_path, 0)))
    for k in range(1, min(counted.count, 24) + 1):
        number = FAULTS[k % len(FAULTS)]
        out = fresh(tmp_path, k)
        capsys.readouterr()
        with refusing.within(tmp_path, k, number):
            code = main(COMMANDS[command](log, out))
        said = capsys.readouterr().err
        assert "internal error" not in said, f"call {k}, {errno.errorcode[number]}: {said}"
        assert code in (0, 1, 2, 3) and (code == 0 or said.strip()), f"call {k}, {errno.errorcode[number]}"


def fresh(folder: Path, k: int) -> Path:
    out = folder / f"out{k}"
    out.mkdir()
    return out


def test_a_full_standard_output_has_words() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-P", "-m", "rtctl.cli.main", "new", "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.returncode == 2 and "no space left on device" in done.stderr and "Traceback" not in done.stderr
