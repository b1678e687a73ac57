"""Doors (connection limiters) of a daemon: under a flood of connections the command socket still answers."""

import contextlib
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon import doors
from rtctl.daemon.client import Client
from rtctl.daemon.doors import FILES, Doors, listen_tcp
from rtctl.daemon.protocol import decode_reply, encode_request
from rtctl.daemon.server import CommandServer
from rtctl.daemon.telemetry import Telemetry

SCARCE = 200  # file descriptors of the daemon in these tests; libzmq aborts when none is left


class Machine:
    """Handler that takes anything."""

    def handle(self, op: str, args: Any) -> dict[str, Any]:
        return {"op": op}


class Daemon:
    """Command socket and telemetry behind doors; `turn` is one turn of the supervisor."""

    def __init__(self, folder: Path, endpoint: str):
        self.doors, self.context = Doors(folder, "m"), zmq.Context()
        self.server = CommandServer(
            endpoint, Machine(), self.context, door=self.doors.door("command", "control", 8, replaces=True)
        )
        self.telemetry = Telemetry(
            f"ipc://{folder}/m.telemetry", "m", ["v"], self.context, door=self.doors.door("telemetry", "viewers", 4)
        )

    def turn(self) -> None:
        self.doors.look()
        self.server.process()
        self.telemetry.publish(np.zeros((1, 2)))
        time.sleep(0.001)

    def close(self) -> None:
        self.telemetry.close()
        self.server.close()
        self.context.destroy(linger=100)
        self.doors.close()

    def ask(self, endpoint: str, op: str = "disarm", within: float = 70.0) -> dict[str, Any]:
        """Send one request as a new client, and turn until it is answered.

        A full queue of connections drops the first packets of a new one; they are sent again after 1, 3, 7, 15, 31 s.
        """
        context = zmq.Context()
        peer = context.socket(zmq.DEALER)
        peer.connect(endpoint)
        peer.send(encode_request(1, op, {}))
        deadline = time.monotonic() + within
        try:
            while not peer.poll(0):
                assert time.monotonic() < deadline, "not answered"
                self.turn()
            return dict(decode_reply(peer.recv()).result)
        finally:
            context.destroy(linger=0)


@pytest.fixture(params=["ipc", "tcp"])
def daemon(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Daemon]:
    made = Daemon(tmp_path, f"ipc://{tmp_path}/m.command" if request.param == "ipc" else "tcp://127.0.0.1:*")
    yield made
    made.close()


def connect(endpoint: str) -> socket.socket | None:
    """A connection that sends nothing; None when the socket does not accept it now."""
    kind, _, address = endpoint.partition("://")
    made = socket.socket(socket.AF_UNIX if kind == "ipc" else socket.AF_INET)
    made.setblocking(False)
    host, _, port = address.rpartition(":")
    try:
        made.connect(address if kind == "ipc" else (host, int(port)))
    except BlockingIOError:
        if kind == "ipc":
            made.close()
            return None
    return made


@contextlib.contextmanager
def flood(daemon: Daemon, endpoint: str, count: int = 300) -> Iterator[list[socket.socket]]:
    held: list[socket.socket] = []
    try:
        while len(held) < count:
            made = connect(endpoint)
            held += [made] if made is not None else []
            if made is None or len(held) % 50 == 0:
                daemon.turn()
        yield held
    finally:
        for each in held:
            each.close()


def test_daemon_behind_doors_answers_and_its_port_is_known(daemon: Daemon) -> None:
    assert not daemon.server.endpoint.endswith("*")
    assert daemon.ask(daemon.server.endpoint) == {"op": "disarm"}
    assert daemon.ask(daemon.server.endpoint, "ping")["pid"] == os.getpid()


def test_command_socket_answers_under_a_flood_of_viewers_and_of_clients(daemon: Daemon) -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    with flood(daemon, daemon.telemetry.endpoint), flood(daemon, daemon.server.endpoint) as own:
        assert daemon.ask(daemon.server.endpoint) == {"op": "disarm"}
        assert (
            len(list(Path("/proc/self/fd").iterdir())) - before < 600 + 60
        )  # sockets of the test, and the places of the doors
        own.append(connect(daemon.server.endpoint) or own[0])
        assert daemon.ask(daemon.server.endpoint, "ping")["pid"] == os.getpid()


def test_pending_request_is_answered_despite_later_connections(daemon: Daemon) -> None:
    daemon.ask(daemon.server.endpoint)  # the door is served
    context = zmq.Context()
    peer = context.socket(zmq.DEALER)
    peer.connect(daemon.server.endpoint)
    peer.send(encode_request(1, "ping", {}))
    assert daemon.server.socket.poll(20_000)  # the request has reached the daemon, which does not process it yet
    held: list[socket.socket] = []
    deadline = time.monotonic() + 60
    try:
        while sum(was_closed(each) for each in held) < 10:  # all places are taken and replaced
            assert time.monotonic() < deadline
            made = connect(daemon.server.endpoint)
            held += [made] if made is not None else []
            time.sleep(0.002)
        while not peer.poll(0):
            assert time.monotonic() < deadline, "not answered"
            daemon.turn()
        assert decode_reply(peer.recv()).id == 1
    finally:
        context.destroy(linger=0)
        for each in held:
            each.close()


def was_closed(end: socket.socket) -> bool:
    """Whether the other side has closed a connection. The call reads the ZMTP greeting first."""
    try:
        while end.recv(4096):
            pass
        return True
    except BlockingIOError:
        return False
    except OSError:
        return True


def test_active_client_keeps_its_connection(daemon: Daemon) -> None:
    context = zmq.Context()
    peer = context.socket(zmq.DEALER)
    peer.setsockopt(zmq.RECONNECT_IVL, -1)  # no reconnection
    peer.connect(daemon.server.endpoint)
    held = []
    try:
        for number in range(40):
            peer.send(encode_request(number, "status", {}))
            while not peer.poll(0):
                daemon.turn()
            assert decode_reply(peer.recv()).id == number
            held.append(connect(daemon.server.endpoint))
            daemon.turn()
    finally:
        context.destroy(linger=0)
        for each in held:
            if each is not None:
                each.close()


def test_viewers_receive_telemetry_and_a_viewer_beyond_the_limit_is_closed(daemon: Daemon) -> None:
    context = zmq.Context()
    viewers = []
    for _ in range(4):
        viewers.append(context.socket(zmq.SUB))
        viewers[-1].subscribe(b"")
        viewers[-1].connect(daemon.telemetry.endpoint)
        while not viewers[-1].poll(0):
            daemon.turn()
    assert msgpack.unpackb(viewers[0].recv_multipart()[1]) == [{"timestamp": 0.0, "v": 0.0}]
    extra = connect(daemon.telemetry.endpoint)
    assert extra is not None
    extra.setblocking(False)
    deadline = time.monotonic() + 20
    data = None
    while data is None:
        assert time.monotonic() < deadline
        daemon.turn()
        with contextlib.suppress(BlockingIOError):
            data = extra.recv(1)
    assert data == b""  # closed by the door
    extra.close()
    context.destroy(linger=0)


def test_viewer_that_does_not_read_does_not_block_the_daemon(daemon: Daemon) -> None:
    context = zmq.Context()
    slow = context.socket(zmq.SUB)
    slow.rcvhwm = 1
    slow.subscribe(b"")
    slow.connect(daemon.telemetry.endpoint)
    for _ in range(300):
        daemon.telemetry.publish(np.zeros((50, 2)))
        daemon.turn()
    assert daemon.ask(daemon.server.endpoint) == {"op": "disarm"}
    context.destroy(linger=0)


def test_killed_door_process_is_restarted(daemon: Daemon) -> None:
    daemon.ask(daemon.server.endpoint)
    process = daemon.doors._processes["control"]
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert daemon.ask(daemon.server.endpoint) == {"op": "disarm"}
    assert daemon.doors._processes["control"].pid != process.pid


def test_reply_to_the_last_request_is_sent_before_the_daemon_closes(tmp_path: Path) -> None:
    made = Daemon(tmp_path, f"ipc://{tmp_path}/m.command")
    made.ask(made.server.endpoint)
    context = zmq.Context()
    peer = context.socket(zmq.DEALER)
    peer.connect(made.server.endpoint)
    peer.send(encode_request(7, "stop", {}))
    made.doors.look()
    assert made.server.socket.poll(20_000)
    made.server.process()
    made.close()
    assert peer.poll(5000) and decode_reply(peer.recv()).id == 7
    assert not list(tmp_path.glob("m.*"))
    context.destroy(linger=0)


@pytest.mark.parametrize(
    ("limits", "then"),
    [
        ((256, 4096), (4096, 4096)),
        ((256, resource.RLIM_INFINITY), (FILES, resource.RLIM_INFINITY)),
        ((80_000, 90_000), None),
    ],
)
def test_limit_of_open_files_is_raised_and_never_lowered(
    monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int], then: tuple[int, int] | None
) -> None:
    kept = []
    monkeypatch.setattr(doors.resource, "getrlimit", lambda _: limits)
    monkeypatch.setattr(doors.resource, "setrlimit", lambda _, new: kept.append(new))
    assert doors.raise_limit() == (then or limits)[0]
    assert kept == ([then] if then else [])


@pytest.mark.parametrize("endpoint", ["tcp://127.0.0.1:99999", "tcp://127.0.0.1:x", "tcp://:5"])
def test_invalid_tcp_address_is_refused(endpoint: str) -> None:
    with pytest.raises(ValueError):
        listen_tcp(endpoint)


def test_tcp_endpoint_may_name_a_network_interface() -> None:
    listener, bound = listen_tcp("tcp://lo:*")
    assert bound == f"tcp://lo:{listener.getsockname()[1]}" and listener.getsockname()[0] == "127.0.0.1"
    listener.close()


def test_address_in_use_is_an_error(daemon: Daemon, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="in use by another"):
        Daemon(tmp_path, daemon.server.endpoint)


@pytest.mark.realtime
def test_daemon_survives_a_connection_flood_with_few_file_descriptors(runtime: Path, tmp_path: Path) -> None:
    """The whole daemon with SCARCE file descriptors, under connections to all of its sockets."""
    words = (
        f"import resource; resource.setrlimit(resource.RLIMIT_NOFILE, ({SCARCE}, {SCARCE}));"
        "from rtctl.cli.main import main; raise SystemExit(main())"
    )
    options = ["--mode", "lockstep", "--no-arm", "--no-plot", "--json", "--out", str(tmp_path / "b"), "--for", "600s"]
    sets = ["--set", "name=flooded", "--set", "loop.realtime=off"]
    run = subprocess.Popen(
        [sys.executable, "-c", words, "run", "ivu", *options, *sets],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "XDG_RUNTIME_DIR": str(runtime)},
    )  # fmt: skip
    assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] > 700
    held: list[socket.socket] = []
    try:
        with Client(f"ipc://{runtime}/rtctl/flooded.command", timeout=20.0) as client:
            deadline = time.monotonic() + 200
            while True:
                with contextlib.suppress(UserError):
                    if client.call("status")["ticks"]:
                        break
                assert run.poll() is None and time.monotonic() < deadline
            for which in ("telemetry", "rows", "command"):
                while len(held) < 200 * (1 + ("telemetry", "rows", "command").index(which)):
                    made = connect(f"ipc://{runtime}/rtctl/flooded.{which}")
                    held += [made] if made is not None else []
            # The flood replaces the connection that was silent longest. A request sent at that moment is lost.
            for _ in range(3):
                with contextlib.suppress(UserError):
                    assert client.call("disarm")
                    break
            else:
                pytest.fail("a client that was there before the flood is not answered any more")
            with Client(f"ipc://{runtime}/rtctl/flooded.command", timeout=30.0) as other:
                assert other.call("status")["state"] == "idle"
                other.call("stop")
        out, err = run.communicate(timeout=60)
        assert run.returncode == 0, err
        assert json.loads(out)["tripped"] is None
    finally:
        for each in held:
            each.close()
        if run.poll() is None:
            run.kill()
            run.communicate()
