"""Doors of a daemon: its listening sockets, each served by a proxy process from the first connection on.

door_process.py forwards a limited number of connections. The command socket has a separate process, so that viewers do
not delay commands. A proxy process that dies is started again at the next connection.
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

from rtctl.config.isolated import python
from rtctl.daemon.log import log

COMMANDERS = 64  # connections at the command socket; a further one replaces the one silent for longest
VIEWERS = 32  # connections at telemetry, and at the rows; a further one is refused
WAITING = 128  # connections that may wait to be accepted
FILES = 65536  # open files, enough for a daemon
SIOCGIFADDR = 0x8915  # netdevice(7)


def raise_limit() -> int:
    """Raise the limit of open files of this process to FILES, or to its hard limit; returns the new limit."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = FILES if hard == resource.RLIM_INFINITY else min(FILES, hard)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return soft
    resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return wanted


class Door:
    """One door: the daemon binds at the path `inner`; clients connect to the socket `listener`."""

    def __init__(self, inner: Path, places: int, replaces: bool):
        self.inner, self.places, self.replaces = inner, places, replaces
        self.listener: socket.socket | None = None

    def serve(self, listener: socket.socket) -> None:
        """Take over a listening socket, once the daemon is bound at `inner`."""
        self.inner.chmod(0o600)
        self.listener = listener


class Doors:
    """The doors of one daemon. Call `look` regularly; `close` ends their processes after pending bytes."""

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
        """Start the process of each door that has a waiting connection and no running process."""
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
        """End the processes. Close the daemon's own sockets first."""
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
    """Listening unix socket at `path`, which no process uses. Raises OSError."""
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
    """Listening socket at tcp://HOST:PORT, and the endpoint with its port; `*` is any host or port, as in ZeroMQ.

    Raises OSError where the address is not available, ValueError where the endpoint is malformed.
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
    """IPv4 address of the network interface `name`; None where there is no such interface."""
    if name not in (known for _, known in socket.if_nameindex()):
        return None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        found = fcntl.ioctl(asking.fileno(), SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
    return socket.inet_ntoa(found[20:24])
