"""The command socket of the daemon, its place in the file system, and the checks before it is bound.

`CommandServer` has a ROUTER socket in the supervisor's poller. Nothing here blocks or starts a thread.
"""

import errno
import fcntl
import os
import re
import socket as sockets
import stat
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, Protocol, TypeVar

import zmq

from rtctl import __version__
from rtctl.config.errors import UserError
from rtctl.config.failures import words
from rtctl.config.private import SOCKETS, check
from rtctl.daemon.client import Client
from rtctl.daemon.doors import Door, listen_ipc, listen_tcp
from rtctl.daemon.keys import ServerCurve, apply_server, refuse_open, require_curve
from rtctl.daemon.log import log
from rtctl.daemon.protocol import VERSIONS, Args, ProtocolError, decode_request, encode_error, encode_result

SYSTEM_DIR = Path("/run/rtctl")
TEMPORARY_DIR = Path("/tmp")
MAX_SOCKET_PATH = 107  # bytes; sockaddr_un holds 108 with the closing zero
MAX_FRAME = 1024 * 1024  # bytes; a larger frame ends the connection. Above MAX_BYTES, so that `too_large` is answered
WAITING = 100  # queued messages for each peer, in either direction
T = TypeVar("T")
MACHINE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")


class Handler(Protocol):
    """Interface to the supervisor: `handle` carries out `op`, returns its result, raises UserError to refuse."""

    def handle(self, op: str, args: Args) -> dict[str, Any]: ...


class CommandServer:
    """Server for requests of any number of clients. `accepted` and `refused[code]` count the answers.

    `ping` is answered here, without the handler, so that it tests the socket and the process only. `heard` is called
    for each `ping`.
    """

    def __init__(
        self,
        endpoint: str,
        handler: Handler,
        context: zmq.Context,
        curve: ServerCurve | None = None,
        heard: Callable[[], None] = lambda: None,
        door: Door | None = None,
    ):
        self._heard = heard
        self.accepted = 0
        self.refused: Counter[str] = Counter()
        self._handler = handler
        self.socket = context.socket(zmq.ROUTER)
        self.socket.linger = 0
        self.socket.rcvhwm = self.socket.sndhwm = WAITING
        self.socket.maxmsgsize = MAX_FRAME
        self.socket.router_mandatory = False  # a reply to a closed or slow client is dropped
        self.endpoint = bind(self.socket, endpoint, curve, door)

    def process(self, max_messages: int = 16) -> int:
        """Answer at most `max_messages` waiting requests, without blocking. Returns their number."""
        for count in range(max_messages):
            try:
                frames = self.socket.recv_multipart(zmq.NOBLOCK)
            except zmq.Again:
                return count
            envelope, payload = frames[:-1], frames[-1]
            if len(envelope) > 2 or any(envelope[1:]):  # identity, then the empty frame of a REQ
                reply = self._refuse(None, "malformed", f"a message of {len(envelope)} parts; send one")
                envelope = envelope[:1]
            else:
                reply = self.answer(payload)
            try:
                self.socket.send_multipart([*envelope, reply], zmq.NOBLOCK)
            except zmq.ZMQError as error:
                log.warning("reply dropped", error=str(error))
        return max_messages

    def answer(self, payload: bytes) -> bytes:
        """Encoded reply to one request. Never raises, for any request and any error of the handler."""
        try:
            request = decode_request(payload)
        except ProtocolError as error:
            return self._refuse(error.id, error.code, error.message)
        try:
            reply = encode_result(request.id, self._do(request.op, request.args))
        except UserError as error:
            return self._refuse(request.id, "refused", str(error))
        except ProtocolError as error:
            return self._refuse(request.id, error.code, f"the result of '{request.op}' is {error.message}")
        except Exception as error:
            if (said := words(error)) is not None:
                return self._refuse(request.id, "refused", said)
            log.exception("command failed", op=request.op)
            return self._refuse(request.id, "internal", f"'{request.op}' failed: {type(error).__name__}: {error}")
        self.accepted += 1
        return reply

    def close(self) -> None:
        release(self.socket, self.endpoint)

    def _do(self, op: str, args: Args) -> dict[str, Any]:
        if op == "ping":
            self._heard()
            return {"pid": os.getpid(), "version": __version__, "protocol": list(VERSIONS)}
        result = self._handler.handle(op, args)
        if not isinstance(result, dict):
            raise TypeError(f"a result must be a map, not {type(result).__name__}")
        return result

    def _refuse(self, id: int | str | None, code: str, message: str) -> bytes:
        self.refused[code] += 1
        return encode_error(id, code, message)


def runtime_dir() -> Path:
    """Folder of sockets: $XDG_RUNTIME_DIR/rtctl, else /run/rtctl if writable, else /tmp/rtctl-UID. Made if missing.

    Raises UserError where the folder cannot be made, or where another user could put a socket into it.
    """
    given = os.environ.get("XDG_RUNTIME_DIR")
    if given:
        folder = _made(Path(given) / "rtctl")
        check(folder, SOCKETS)
        return folder
    if os.access(SYSTEM_DIR, os.W_OK | os.X_OK):
        return SYSTEM_DIR
    folder = _made(TEMPORARY_DIR / f"rtctl-{os.geteuid()}")
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & 0o077:
        raise UserError(f"{folder} is not a private folder of this user (mode 0700); remove it or set XDG_RUNTIME_DIR")
    return folder


def default_endpoint(machine_name: str, which: Literal["command", "telemetry", "rows"]) -> str:
    """The ipc endpoint of a machine's `command`, `telemetry` or `rows` socket."""
    if not MACHINE.fullmatch(machine_name):
        raise UserError(f"'{machine_name}' cannot name a socket; use letters, digits, '_', '-' and '.'")
    path = runtime_dir() / f"{machine_name}.{which}"
    _check_path(path)
    return f"ipc://{path}"


def find_endpoint(machine_name: str, which: Literal["command", "telemetry", "rows"]) -> str:
    """Endpoint for clients: the socket of the user's own daemon, else of the system service, if there is one."""
    own = default_endpoint(machine_name, which)
    service = SYSTEM_DIR / f"{machine_name}.{which}"
    return f"ipc://{service}" if service.exists() and not Path(own.removeprefix("ipc://")).exists() else own


def bind(socket: zmq.Socket, endpoint: str, curve: ServerCurve | None = None, door: Door | None = None) -> str:
    """Bind and return the endpoint as bound, with a tcp port for `*`. With a `door`, clients connect to its listener.

    Raises UserError, with the socket closed, for a bad address, one in use, or one open to the network without keys.
    """
    try:
        if curve is not None:
            apply_server(socket, curve.keys, curve.authorized)
        elif require_curve(endpoint):
            raise refuse_open(endpoint)
        if door is not None:
            return _bind_behind(socket, endpoint, door)
        socket.ipv6 = "[" in endpoint
        if endpoint.startswith("ipc://"):
            path = Path(endpoint.removeprefix("ipc://"))
            _bind_ipc(path, lambda: socket.bind(f"ipc://{path}"))
        else:
            socket.bind(endpoint)
        return socket.getsockopt_string(zmq.LAST_ENDPOINT)
    except (OSError, zmq.ZMQError) as error:
        socket.close(linger=0)
        raise _bind_error(endpoint, error, curve) from None
    except BaseException:
        socket.close(linger=0)
        raise


def release(socket: zmq.Socket, endpoint: str) -> None:
    """Close a socket that `bind` bound, and remove its file, so that no client looks for a daemon there."""
    socket.close(linger=0)
    if endpoint.startswith("ipc://"):
        Path(endpoint.removeprefix("ipc://")).unlink(missing_ok=True)


def _bind_behind(socket: zmq.Socket, endpoint: str, door: Door) -> str:
    """Bind at the inner end of a door, and listen at its outer end; returns the outer endpoint."""
    _check_path(door.inner)
    if endpoint.startswith("ipc://"):
        path, bound = Path(endpoint.removeprefix("ipc://")), endpoint
        listener = _bind_ipc(path, lambda: listen_ipc(path))
    else:
        try:
            listener, bound = listen_tcp(endpoint)
        except ValueError:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL)) from None
    try:
        socket.bind(f"ipc://{door.inner}")
        door.serve(listener)
    except BaseException:
        listener.close()
        raise
    return bound


def _bind_ipc(path: Path, binds: Callable[[], T]) -> T:
    """Result of `binds`, which binds at `path`. Raises UserError where the path is in use.

    `binds` removes any file at the path, even the socket of a running daemon or a person's file. So the path is checked
    first, with the folder locked against another daemon that checks at the same time.
    """
    _check_path(path)
    try:
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise UserError(f"the folder of ipc://{path} cannot be used: {error.strerror}") from None
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        pid = _listener(path)
        if pid is not None:
            raise UserError(f"ipc://{path} is in use by another daemon (pid {pid}); stop it, or use another name")
        return binds()
    finally:
        os.close(folder)


def _listener(path: Path) -> int | None:
    """The pid of the process that listens on a socket file; None without a file, or with one left by a crash."""
    try:
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise UserError(f"{path} exists and is not a socket; remove it, or use another endpoint")
    except FileNotFoundError:
        return None
    with sockets.socket(sockets.AF_UNIX, sockets.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except (FileNotFoundError, ConnectionRefusedError):
            return None
        except OSError as error:
            raise UserError(f"cannot find out who uses {path}: {error.strerror}") from None
        peer = probe.getsockopt(sockets.SOL_SOCKET, sockets.SO_PEERCRED, struct.calcsize("3i"))
    return struct.unpack("3i", peer)[0]


def _bind_error(endpoint: str, error: OSError | zmq.ZMQError, curve: ServerCurve | None) -> UserError:
    if error.errno != errno.EADDRINUSE:
        return UserError(f"cannot bind {endpoint}: {error.strerror}; expected ipc:///PATH or tcp://ADDRESS:PORT")
    try:
        if curve is not None or not endpoint.startswith("tcp://"):
            raise UserError("cannot ask")
        with Client(endpoint, timeout=0.5) as client:
            pid = client.call("ping")["pid"]
        return UserError(f"{endpoint} is in use by another daemon (pid {pid}); stop it, or use another port")
    except (UserError, KeyError):
        return UserError(f"{endpoint} is in use by another program; use another address, or find it with `ss -lptn`")


def _check_path(path: Path) -> None:
    length = len(os.fsencode(path))
    if length > MAX_SOCKET_PATH:
        raise UserError(
            f"the socket path {path} is {length} bytes long, and {MAX_SOCKET_PATH} is the most that a unix socket"
            " takes; set XDG_RUNTIME_DIR to a shorter folder, or name a shorter endpoint"
        )
    if not path.is_absolute():
        raise UserError(f"ipc://{path} is not an absolute path; write e.g. ipc:///run/rtctl/ivu.command")


def _made(folder: Path) -> Path:
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot make the folder for sockets {folder}: {error.strerror}") from None
    return folder
