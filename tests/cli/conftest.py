"""Fixtures: the command line inside the test process, and a daemon in a separate process."""

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

# Safety limits that do not trip on a busy machine.
PATIENT = ("loop.realtime=off", "safety.link_timeout=10", "safety.missed_ticks=0", "safety.following_error=0")


class Said(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def rtctl(capsys: pytest.CaptureFixture[str]) -> Callable[..., Said]:
    """`rtctl("status", "--json")` returns exit code, stdout and stderr."""

    def call(*arguments: Any) -> Said:
        capsys.readouterr()
        code = main([str(a) for a in arguments])
        return Said(code, *capsys.readouterr())

    return call


@contextlib.contextmanager
def process(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`rtctl` as a process. The process and its children end with the context."""
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
    """A machine in real mode, not armed. The context starts when the command socket answers and the loop ticks."""
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
    """`with running(name, folder) as process:` a running machine that accepts commands."""
    return daemon


@pytest.fixture(scope="module")
def machine(runtime: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Name of a machine that runs during all tests of a module."""
    name = f"cli{os.getpid()}"
    with daemon(name, tmp_path_factory.mktemp("run") / "bundle"):
        yield name
