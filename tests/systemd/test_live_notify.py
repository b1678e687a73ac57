"""A machine under a stubbed service manager: start, watchdog, reload and stop."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from rtctl.daemon.client import Client
from rtctl.daemon.server import default_endpoint
from rtctl.daemon.shared_memory import segment_path

CONFIG = Path(__file__).parents[2] / "configs" / "ivu.yaml"
WATCHDOG = 200_000  # us


class Manager:
    """Stub of a service manager: listens at NOTIFY_SOCKET and keeps every message with the pid of its sender."""

    def __init__(self, path: Path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        self.socket.bind(str(path))
        self.environment = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": str(WATCHDOG)}
        self.messages: list[str] = []
        self.pids: set[int] = set()

    def next(self, word: str, seconds: float = 60.0) -> str:
        """Wait for the next message with `word`; returns the message."""
        deadline = time.monotonic() + seconds
        while True:
            for i, message in enumerate(self.messages):
                if word in message.split("\n"):
                    del self.messages[: i + 1]
                    return message
            assert time.monotonic() < deadline, f"no {word} came; there were {self.messages}"
            self.take(0.2)

    def take(self, seconds: float = 0.0) -> list[str]:
        """All messages until now; with `seconds`, at most that long until the first."""
        self.socket.settimeout(seconds)
        while True:
            try:
                data, credentials, _, _ = self.socket.recvmsg(4096, socket.CMSG_SPACE(12))
            except (BlockingIOError, TimeoutError):
                return self.messages
            self.pids.add(int.from_bytes(credentials[0][2][:4], sys.byteorder))
            self.messages.append(data.decode())
            self.socket.settimeout(0.0)


@pytest.fixture
def manager(runtime: Path) -> Iterator[Manager]:
    made = Manager(runtime / f"notify-{time.monotonic_ns()}")
    yield made
    made.socket.close()


def stretch(usec: int) -> Iterator[None]:
    """Up to `count` items within a time."""
    end = time.monotonic_ns() + 1000 * usec
    while time.monotonic_ns() < end:
        yield


class Running:
    """`rtctl` started as by a service manager, with a separate config file."""

    def __init__(self, command: str, manager: Manager, folder: Path, options: tuple[str, ...], **keys: Any):
        self.config = yaml.safe_load(CONFIG.read_text()) | {"name": f"s{os.getpid()}-{time.monotonic_ns() % 10**8}"}
        self.config["loop"] |= {"mode": "lockstep", "realtime": "off"}
        self.config["link"] = {"kind": "shm"}
        self.config |= keys
        self.file = folder / "machine.yaml"
        self.write()
        words = [sys.executable, "-m", "rtctl.cli.main", command, str(self.file), *options]
        self.process = subprocess.Popen(
            words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=os.environ | manager.environment
        )

    def write(self) -> None:
        self.file.write_text(yaml.safe_dump(self.config))

    def call(self, op: str, **arguments: Any) -> Any:
        with Client(default_endpoint(self.config["name"], "command"), timeout=10.0) as client:
            return client.call(op, **arguments)

    def child(self, role: str) -> int:
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return next(int(pid) for pid in children if role in Path(f"/proc/{pid}/cmdline").read_text())

    def end(self) -> str:
        """Stop as with KillMode=control-group; returns the output."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        for pid in (*map(int, children), self.process.pid):
            os.kill(pid, signal.SIGTERM)
        return self.process.communicate(timeout=60)[0]


@pytest.fixture
def start(manager: Manager, tmp_path: Path) -> Iterator[Callable[..., Running]]:
    made: list[Running] = []

    def begin(command: str = "run", *options: str, **keys: Any) -> Running:
        made.append(Running(command, manager, tmp_path, options, **keys))
        return made[-1]

    yield begin
    for each in made:
        each.process.kill()
        each.process.communicate()
        segment_path(each.config["name"]).unlink(missing_ok=True)


SERVICE = ("--no-arm", "--no-plot", "--json", "--out")


def test_service_starts_reloads_and_stops(manager: Manager, start: Callable[..., Running], tmp_path: Path) -> None:
    machine = start("run", *SERVICE, str(tmp_path / "bundle"))
    manager.next("READY=1", 200)
    assert machine.call("status")["ticks"] >= 100
    manager.next("WATCHDOG=1")
    manager.next("WATCHDOG=1")

    machine.config["law"]["position"]["gain"] = "20 V/rad"
    machine.config["loop"]["rate"] = "250 Hz"
    machine.write()
    asked = time.monotonic_ns() // 1000
    machine.process.send_signal(signal.SIGHUP)
    told = dict(line.split("=", 1) for line in manager.next("RELOADING=1").split("\n"))
    assert asked <= int(told["MONOTONIC_USEC"]) <= time.monotonic_ns() // 1000
    manager.next("READY=1")
    assert machine.call("get", path="law.position.gain")["value"] == 20.0
    assert machine.call("get", path="loop.rate")["value"] == 500.0

    machine.file.write_text("machine: [")
    machine.process.send_signal(signal.SIGHUP)
    manager.next("RELOADING=1")
    manager.next("READY=1")
    assert machine.call("get", path="law.position.gain")["value"] == 20.0

    said = machine.end()
    manager.next("STOPPING=1")
    assert machine.process.returncode == 0, said
    assert manager.pids == {machine.process.pid}  # NotifyAccess=main
    assert "loop.rate cannot change while the machine runs" in said
    assert "not YAML" in said
    case = json.loads((tmp_path / "bundle" / "case.json").read_text())
    assert [(c["path"], c["value"]) for c in case["changes"]] == [("law.position.gain", 20.0)]


def test_stopped_loop_sends_no_watchdog_message(
    manager: Manager, start: Callable[..., Running], tmp_path: Path
) -> None:
    machine = start("run", *SERVICE, str(tmp_path / "bundle"))
    manager.next("READY=1", 200)
    manager.next("WATCHDOG=1")
    loop = machine.child("loop_process")
    os.kill(loop, signal.SIGSTOP)
    try:
        ticks = [machine.call("status")["ticks"] for _ in stretch(WATCHDOG)]
        manager.take().clear()  # one more message is possible, for the ticks before the stop
        ticks += [machine.call("status")["ticks"] for _ in stretch(3 * WATCHDOG)]
        assert len(set(ticks)) == 1  # the supervisor runs, the loop does not tick
        assert "WATCHDOG=1" not in manager.take()
    finally:
        os.kill(loop, signal.SIGCONT)
    manager.next("WATCHDOG=1")
    machine.end()


def test_service_with_an_invalid_config_is_never_ready(
    manager: Manager, start: Callable[..., Running], tmp_path: Path
) -> None:
    machine = start("run", *SERVICE, str(tmp_path / "bundle"), law={"nonsense": 1})
    out, _ = machine.process.communicate(timeout=60)
    assert machine.process.returncode == 2 and "nonsense" in out
    assert not manager.take()


def test_short_fused_run_is_ready_and_then_stops(
    manager: Manager, start: Callable[..., Running], tmp_path: Path
) -> None:
    machine = start("run", "--mode", "fused", "--for", "1s", *SERVICE, str(tmp_path / "bundle"))
    manager.next("READY=1", 200)
    manager.next("STOPPING=1")
    out, _ = machine.process.communicate(timeout=60)
    assert machine.process.returncode == 0, out


def test_plant_is_ready_when_it_listens(manager: Manager, start: Callable[..., Running], runtime: Path) -> None:
    plant = start("plant", "--endpoint", f"ipc://{runtime}/plant-{time.monotonic_ns()}")
    assert "STATUS=listens at ipc://" in manager.next("READY=1", 200)
    out = plant.end()
    manager.next("STOPPING=1")
    assert plant.process.returncode == 0, out
