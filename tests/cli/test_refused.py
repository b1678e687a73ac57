"""Refused system calls give an error message; `internal error` is for program errors only."""

import contextlib
import errno
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import small
from narrowed import only

from rtctl.api import load_config, record
from rtctl.cli.main import main

CALLS = ("open", "os.mkdir", "os.rename", "os.remove", "os.listdir", "os.scandir", "os.link", "os.truncate", "os.chmod")
FAULTS = (
    errno.ENOSPC,
    errno.EMFILE,
    errno.EACCES,
    errno.EPERM,
    errno.EISDIR,
    errno.EROFS,
    errno.EIO,
    errno.ENOENT,
    errno.ENOMEM,
)


class Refusing:
    """Audit hook: system call number `at` below a folder fails with errno `number`."""

    def __init__(self) -> None:
        self.at, self.number, self.count = -1, 0, 0
        self.folders: tuple[str, ...] = ()
        sys.addaudithook(self)  # permanent: an audit hook cannot be removed, and does nothing without a folder

    def __call__(self, event: str, arguments: tuple) -> None:
        if not self.folders or event not in CALLS or not str(arguments[0]).startswith(self.folders):
            return
        self.count += 1
        if self.count == self.at:
            raise OSError(self.number, os.strerror(self.number), str(arguments[0]))

    @contextlib.contextmanager
    def within(self, folders: tuple[Path, ...], at: int = -1, number: int = 0) -> Iterator["Refusing"]:
        self.folders, self.at, self.number, self.count = tuple(map(str, folders)), at, number, 0
        try:
            yield self
        finally:
            self.folders = ()


refusing = Refusing()


COMMANDS: dict[str, Callable[[Path, Path], list[str]]] = {
    "check": lambda here, out: ["check", str(here / "axis.yaml")],
    "import": lambda here, out: [*IMPORT, str(here / "log.csv"), "-o", str(out / "made")],
    "new": lambda here, out: ["new", "law", "refused", "--into", str(out / "laws")],
    "repair": lambda here, out: ["trace", "repair", str(here / "repaired")],
    "export": lambda here, out: ["trace", "export", str(here / "imported"), "--to", "csv", "-o", str(out / "x.csv")],
    "compare": lambda here, out: ["trace", "compare", str(here / "recorded"), str(here / "recorded")],
    "plot": lambda here, out: ["trace", "plot", str(here / "recorded"), "-o", str(out / "x.png")],
    "run": lambda here, out: [*RUN, "--set", f"name=refused{os.getpid()}", "-o", str(out / "run")],
    "replay": lambda here, out: ["replay", str(here / "recorded")],
    "identify": lambda here, out: ["identify", "radius", "ivu", "--plot", str(out / "x.png")],
    "campaign": lambda here, out: ["campaign", "run", str(here / "matrix.yaml"), "-j", "1", "--out", str(out / "all")],
    "reproduce": lambda here, out: ["reproduce", "--only", "8.delay", "--short", "-j", "1", "--out", str(out)],
    "diagnose": lambda here, out: ["diagnose", str(here / "imported"), "--no-report", "-o", str(out / "found")],
}
RUN = ("run", "ivu", "--mode", "fused", "--for", "0.1s", "--no-plot")
IMPORT = ("import", "--plant", "axis", "--parameter", "M=1")
TRIED = {"run": 2, "campaign": 5, "reproduce": 2, "diagnose": 4}  # calls refused where a command takes long; else 24
FILLED = {"run": 1, "campaign": 3, "reproduce": 1}  # sizes of a full disk, from small to large


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the inputs of the commands: a log, its imported bundle, a recording, a campaign."""
    folder = tmp_path_factory.mktemp("refused")
    (folder / "matrix.yaml").write_text(small.MATRIX)
    shutil.copy(Path(__file__).parents[2] / "configs" / "axis.yaml", folder)
    assert main([*IMPORT, str(small.log_of(folder)), "-o", str(folder / "imported")]) == 0
    shutil.copytree(folder / "imported", folder / "repaired")
    record(load_config("ivu", {"name": "refused", "loop.mode": "fused"}), 0.1, folder / "recorded")
    return folder


@pytest.fixture
def command(
    request: pytest.FixtureRequest, runtime: Path, here: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[Path], int]:
    """`command(out)` calls the command of this name; searches and plots are stubbed."""
    only(monkeypatch, "load.spring")
    for name in ("overlay", "distributions", "along", "png"):
        monkeypatch.setattr(f"rtctl.campaign.figures.{name}", lambda *_: "")
    return lambda out: main(COMMANDS[request.param](here, out))


@pytest.mark.parametrize("command", COMMANDS, indirect=True)
def test_every_refused_system_call_gives_an_error_message(
    command: Callable[[Path], int],
    request: pytest.FixtureRequest,
    here: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    name = request.node.callspec.params["command"]
    out = fresh(tmp_path, 0)
    with refusing.within((here, tmp_path)) as counted:
        command(out)
    tried = np.unique(np.linspace(1, counted.count, min(counted.count, TRIED.get(name, 24))).astype(int))
    codes = []
    for k in tried.tolist():
        number = FAULTS[k % len(FAULTS)]
        out = fresh(tmp_path, k)
        capsys.readouterr()
        with refusing.within((here, tmp_path), k, number):
            codes.append(command(out))
        judge(codes[-1], capsys.readouterr().err, f"call {k}, {errno.errorcode[number]}")
    assert any(codes), "nothing was refused"


@pytest.mark.parametrize("command", [c for c in COMMANDS if c not in ("check", "compare", "replay")], indirect=True)
def test_full_disk_gives_an_error_message(
    command: Callable[[Path], int],
    request: pytest.FixtureRequest,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A limit on the file size emulates a full disk for every library."""
    name = request.node.callspec.params["command"]
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    codes = []
    for k, size in enumerate((0, 700, 20_000)[: FILLED.get(name, 3)]):
        out = fresh(tmp_path, k)
        capsys.readouterr()
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
        try:
            codes.append(command(out))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        judge(codes[-1], capsys.readouterr().err, f"{size} bytes")
    assert 2 in codes or name in ("repair", "new")  # where nothing is written, or less


def judge(code: int, said: str, where: str) -> None:
    assert "internal error" not in said and "Traceback" not in said, f"{where}: {said}"
    assert code in (0, 1, 2, 3) and (code == 0 or said.strip()), where


def fresh(folder: Path, k: int) -> Path:
    out = folder / f"out{k}"
    out.mkdir()
    return out


def test_full_standard_output_gives_an_error_message() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-P", "-m", "rtctl.cli.main", "new", "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.returncode == 2 and "no space left on device" in done.stderr and "Traceback" not in done.stderr
