"""The command line inside the test process, and a daemon outside of it."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from rtctl.cli.main import main
from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.daemon.server import default_endpoint

# A busy machine may keep the loop waiting for longer than a real one would bear.
PATIENT = ("loop.realtime=off", "safety.link_timeout=10", "safety.missed_ticks=0", "safety.following_error=0")


class Said(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def rtctl(capsys: pytest.CaptureFixture[str]) -> Callable[..., Said]:
    """`rtctl("status", "--json")` gives the exit code and what was printed."""

    def call(*arguments: Any) -> Said:
        capsys.readouterr()
        code = main([str(a) for a in arguments])
        return Said(code, *capsys.readouterr())

    return call


@contextlib.contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`rtctl` as a process. Whatever happens, it ends, and its children with it."""
    command = [sys.executable, "-m", "rtctl.cli.main", *arguments]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ})
    with run:
        try:
            yield run
        finally:
            if run.poll() is None:
                run.send_signal(signal.SIGTERM)
                try:
                    run.wait(60)
                except subprocess.TimeoutExpired:
                    run.kill()


@contextlib.contextmanager
def daemon(name: str, folder: Path, *more: str) -> Iterator[subprocess.Popen[str]]:
    """A machine that runs in real time, not armed; entered when its command socket answers and its loop ticks."""
    changes = [word for change in (f"name={name}", *PATIENT) for word in ("--set", change)]
    options = ["--no-arm", "--no-plot", "--json", "--out", str(folder), *changes, *more]
    with process("run", "ivu", "--mode", "real", "--link", "shm", *options) as run:
        with Client(default_endpoint(name, "command"), timeout=1.0) as client:
            deadline = time.monotonic() + 200
            while not _ticks(client):
                assert run.poll() is None, run.communicate()[1]
                assert time.monotonic() < deadline
        yield run


def _ticks(client: Client) -> bool:
    try:
        return client.call("status")["ticks"] > 0
    except UserError:
        return False


@pytest.fixture
def started() -> Callable[..., Any]:
    """`with started("plant", "ivu") as process:`"""
    return process


@pytest.fixture
def running(runtime: Path) -> Callable[..., Any]:
    """`with running(name, folder) as process:` a machine that is there to be commanded."""
    return daemon


@pytest.fixture(scope="module")
def machine(runtime: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The name of a machine that runs for all tests of a module."""
    name = f"cli{os.getpid()}"
    with daemon(name, tmp_path_factory.mktemp("run") / "bundle"):
        yield name
