"""Doors of the daemon: its listening sockets, each watched until somebody comes, then served by a process of its own.

What comes in goes through door_process.py, a limited number at a time. Control has a process of its own, so that
viewers cannot be in its way. A door that dies is opened again at the next connection.
"""

import fcntl
import json
import resource
import select
import socket
import struct
import subprocess
from pathlib import Path
from typing import Any

import structlog

from rtctl.config.isolated import python

log = structlog.get_logger()
COMMANDERS = 64  # places at the command socket; one more takes that of who has been silent for longest
VIEWERS = 32  # at telemetry, and at the rows; one more is not let in
WAITING = 128  # connections that wait to be taken
FILES = 65536  # open files that are enough for all that a daemon has
SIOCGIFADDR = 0x8915  # netdevice(7)


def raise_limit() -> int:
    """Raise the limit of open files of this process to FILES, or to what it may have; returns it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = FILES if hard == resource.RLIM_INFINITY else min(FILES, hard)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return soft
    resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return wanted


class Door:
    """A way in: `inner` is the path at which the daemon binds, `listener` the socket at which others connect."""

    def __init__(self, inner: Path, places: int, replaces: bool):
        self.inner, self.places, self.replaces = inner, places, replaces
        self.listener: socket.socket | None = None

    def serve(self, listener: socket.socket) -> None:
        """Take over a listening socket, once the daemon is bound at `inner`."""
        self.inner.chmod(0o600)
        self.listener = listener


class Doors:
    """The doors of one daemon. Call `look` now and then; `close` lets what is under way come to its end."""

    def __init__(self, folder: Path, name: str):
        self._folder, self._name = folder, name
        self._doors: dict[str, list[Door]] = {}  # process -> doors
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def door(self, which: str, process: str, places: int, replaces: bool = False) -> Door:
        """A new door for the socket `which`, served by the process of this name."""
        made = Door(self._folder / f"{self._name}.{which}~", places, replaces)
        self._doors.setdefault(process, []).append(made)
        return made

    def look(self) -> None:
        """Start the process of each door at which somebody waits and nobody serves."""
        for process, doors in self._doors.items():
            running = self._processes.get(process)
            if running is not None and running.poll() is None:
                continue
            if running is not None:
                log.warning("door ended", door=process, code=running.returncode)
                del self._processes[process]
            waits = select.poll()  # not select(), which takes no descriptor beyond 1023
            for door in doors:
                if door.listener is not None:
                    waits.register(door.listener, select.POLLIN)
            if waits.poll(0):
                self._processes[process] = _start(doors)

    def close(self) -> None:
        """End the processes. The daemon's own sockets are closed before."""
        for process in self._processes.values():
            assert process.stdin is not None
            process.stdin.close()
        for process in self._processes.values():
            try:
                process.wait(2.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for doors in self._doors.values():
            for door in doors:
                door.inner.unlink(missing_ok=True)
                if door.listener is not None:
                    door.listener.close()


def _start(doors: list[Door]) -> "subprocess.Popen[bytes]":
    orders: list[dict[str, Any]] = [
        {"fd": door.listener.fileno(), "inner": str(door.inner), "places": door.places, "replaces": door.replaces}
        for door in doors
        if door.listener is not None
    ]
    return subprocess.Popen(
        python("-m", "rtctl.daemon.door_process", json.dumps(orders)),
        stdin=subprocess.PIPE,
        pass_fds=[order["fd"] for order in orders],
    )


def listen_ipc(path: Path) -> socket.socket:
    """A listening socket at a path at which nobody listens. Raises OSError."""
    path.unlink(missing_ok=True)
    made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        made.bind(str(path))
        made.listen(WAITING)
    except OSError:
        made.close()
        raise
    return made


def listen_tcp(endpoint: str) -> tuple[socket.socket, str]:
    """A listening socket at tcp://HOST:PORT as ZeroMQ writes it, and the endpoint with its port; `*` is any.

    Raises OSError where it cannot be had, ValueError where it is no such endpoint.
    """
    host, _, port = endpoint.removeprefix("tcp://").rpartition(":")
    number = 0 if port == "*" else int(port)
    if not host or not 0 <= number <= 65535:
        raise ValueError(endpoint)
    bare = host.strip("[]")
    six = host.startswith("[")
    address = "" if bare == "*" else _of_interface(bare) or bare
    made = socket.create_server((address, number), family=socket.AF_INET6 if six else socket.AF_INET, backlog=WAITING)
    return made, f"tcp://{'0.0.0.0' if host == '*' else host}:{made.getsockname()[1]}"


def _of_interface(name: str) -> str | None:
    """IPv4 address of a network interface; None where it is none."""
    if name not in (known for _, known in socket.if_nameindex()):
        return None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        found = fcntl.ioctl(asking.fileno(), SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
    return socket.inet_ntoa(found[20:24])
