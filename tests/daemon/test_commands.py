"""Which clients count as the commander of a machine that requires one."""

from types import SimpleNamespace
from typing import Any

import pytest
import zmq

from rtctl.daemon import commands
from rtctl.daemon.commands import LOOKS, Commands
from rtctl.daemon.protocol import OPS, NoArgs, encode_request
from rtctl.daemon.server import CommandServer


class Machine:
    """Stub of a supervisor; `lost` is the last value of `commander_lost` sent to the loop."""

    def __init__(self) -> None:
        self.config = SimpleNamespace(
            safety=SimpleNamespace(require_commander=True, commander_timeout=1.0),
            loop=SimpleNamespace(mode="fused"),  # in real mode the loop checks the timeout itself
        )
        self.status = {"tick": 0, "state": 0}
        self.command: dict[str, int] = {"disarm": 0}
        self.segment = {"mailbox": [{"command": self.command, "count": 0}]}
        self.report = self.signals = dict

    def order(self, write: Any, changed: Any = None) -> None:
        write(None, self.command)

    @property
    def lost(self) -> int:
        return self.command.get("commander_lost", 0)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """`clock[0]` is the time, s."""
    now = [100.0]
    monkeypatch.setattr(commands.time, "monotonic", lambda: now[0])
    return now


def test_read_only_requests_do_not_count_as_a_commander(clock: list[float]) -> None:
    machine: Any = Machine()
    handler = Commands(machine)
    for _ in range(4):
        clock[0] += 0.3
        handler.handle("status", NoArgs())
        handler.handle("signals", NoArgs())
        handler.watch_commander()
    assert machine.lost == 1
    handler.handle("disarm", NoArgs())
    handler.watch_commander()
    assert machine.lost == 0
    assert set(LOOKS) <= set(OPS)


def test_ping_resets_the_commander_timeout(clock: list[float], tmp_path: Any) -> None:
    machine: Any = Machine()
    handler, context = Commands(machine), zmq.Context()
    server = CommandServer(f"ipc://{tmp_path}/s", handler, context, heard=handler.heard)
    clock[0] += 5.0
    handler.watch_commander()
    assert machine.lost == 1
    socket = context.socket(zmq.DEALER)
    socket.connect(server.endpoint)
    socket.send(encode_request(1, "ping", {}))
    assert server.socket.poll(10_000)
    server.process()
    handler.watch_commander()
    assert machine.lost == 0
    server.close()
    context.destroy(linger=0)
