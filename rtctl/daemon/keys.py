"""CURVE keys: they decide who may command a daemon over the network, and prove the daemon's identity to a client.

A pair NAME is two files in one folder: NAME.key, public, and NAME.key_secret, readable by its owner only. The daemon
uses the pair `server` and accepts clients whose public files are in the folder `authorized` beside it.

Source: RFC 26/CurveZMQ and RFC 27/ZAP of rfc.zeromq.org.
"""

import ipaddress
import itertools
import os
import re
import struct
import threading
from pathlib import Path
from typing import NamedTuple

import zmq
from platformdirs import user_config_path
from zmq.auth import load_certificate
from zmq.utils import z85

from rtctl.config.errors import UserError
from rtctl.daemon.log import log

NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}")


class Keys(NamedTuple):
    """A key pair in Z85 text, as zmq takes it."""

    public: bytes
    secret: bytes


class ServerCurve(NamedTuple):
    """Keys of a daemon: its own pair and the public keys of the clients that it accepts."""

    keys: Keys
    authorized: frozenset[bytes]


class ClientCurve(NamedTuple):
    """Keys of a client: its own pair and the public key of the daemon."""

    keys: Keys
    server: bytes


def keys_dir() -> Path:
    return user_config_path("rtctl") / "keys"


def new_keys(name: str = "server", directory: Path | None = None) -> tuple[Path, Path]:
    """Make the pair `name`; returns the paths of its public and its secret file. Raises UserError where it exists."""
    public_path, secret_path = _paths(name, directory)
    public, secret = zmq.curve_keypair()
    try:
        (public_path.parent / "authorized").mkdir(parents=True, exist_ok=True, mode=0o700)
        _write(secret_path, 0o600, f'secret key of "{name}": keep it', {"public-key": public, "secret-key": secret})
        _write(public_path, 0o644, f'public key of "{name}": give it away', {"public-key": public})
    except FileExistsError as error:
        raise UserError(f"{error.filename} exists; remove it first if '{name}' is to get new keys") from None
    except OSError as error:
        raise UserError(f"cannot write keys to {public_path.parent}: {error.strerror}") from None
    return public_path, secret_path


def load_keys(name: str = "server", directory: Path | None = None) -> Keys:
    """The pair `name`. Raises UserError where it is missing, damaged, or its secret can be read by others."""
    path = _paths(name, directory)[1]
    try:
        mode = path.stat().st_mode & 0o777
    except OSError:
        raise UserError(f"no secret key {path}; make it with `rtctl keys new {name}`") from None
    if mode & 0o077:
        raise UserError(f"{path} can be read by others (mode {mode:04o}); run `chmod 600 {path}` or make new keys")
    public, secret = _read(path)
    if secret is None:
        raise UserError(f"{path} holds no secret key; make a new pair with `rtctl keys new {name}`")
    return Keys(public, secret)


def load_public(path: Path) -> bytes:
    """The public key in a file. Raises UserError where there is none."""
    return _read(path)[0]


def server_curve(directory: Path | None = None) -> ServerCurve:
    """The pair `server` and every key in `authorized`. Raises UserError where either is missing."""
    folder = (directory or keys_dir()) / "authorized"
    authorized = frozenset(load_public(path) for path in sorted(folder.glob("*.key")))
    if not authorized:
        raise UserError(f"no client may connect: copy the public NAME.key of each client to {folder}")
    return ServerCurve(load_keys("server", directory), authorized)


def client_curve(name: str = "client", directory: Path | None = None) -> ClientCurve:
    """The pair `name` and the daemon's public server.key, all in one folder. Raises UserError where one is missing."""
    return ClientCurve(load_keys(name, directory), load_public(_paths("server", directory)[0]))


def require_curve(endpoint: str) -> bool:
    """Whether other computers can reach the endpoint: any but ipc, inproc and tcp on a loopback address."""
    if endpoint.startswith(("ipc://", "inproc://")):
        return False
    address = endpoint.removeprefix("tcp://")
    host = (address.rpartition(":")[0] or address).strip("[]")
    try:
        return host != "localhost" and not ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, an interface or a wildcard: not known to be loopback
        return True


def refuse_open(endpoint: str) -> UserError:
    """UserError for a malformed endpoint, or for one that needs keys and has none."""
    if not endpoint.startswith("tcp://"):
        return UserError(f"'{endpoint}' is no endpoint; expected ipc:///PATH or tcp://ADDRESS:PORT")
    return UserError(
        f"{endpoint} can be reached from other machines and needs keys: run `rtctl keys new`"
        " (and see docs/protocol.md), or use ipc:// or tcp://127.0.0.1"
    )


def apply_server(socket: zmq.Socket, keys: Keys, authorized_client_keys: frozenset[bytes]) -> None:
    """Accept only clients with one of these public keys; call before bind. A thread of the context checks them."""
    socket.setsockopt_string(zmq.ZAP_DOMAIN, _doorman(socket.context).admit(authorized_client_keys))
    socket.setsockopt(zmq.ZAP_ENFORCE_DOMAIN, 1)  # without the Doorman all clients are refused, not accepted
    socket.curve_server = True
    socket.curve_publickey, socket.curve_secretkey = keys


def apply_client(socket: zmq.Socket, keys: Keys, server: bytes) -> None:
    """Set a client's keys, so that it connects only to the owner of `server`; call before connect."""
    socket.curve_serverkey = server
    socket.curve_publickey, socket.curve_secretkey = keys


class Doorman:
    """ZAP authenticator of a context: checks the client's key for each new connection.

    Its thread ends with its context. Its socket belongs to a shadow of the context. Otherwise `context.destroy()` would
    close the socket while the thread waits on it, and libzmq would abort the process.
    """

    def __init__(self, context: zmq.Context):
        self._known: dict[str, frozenset[bytes]] = {}
        self._numbers = itertools.count()
        self._context = context
        shadow: zmq.Context = zmq.Context.shadow(context.underlying)
        self._socket = shadow.socket(zmq.REP)
        self._socket.linger = 0
        self._socket.bind("inproc://zeromq.zap.01")
        threading.Thread(target=self._serve, name="rtctl-doorman", daemon=True).start()

    def admit(self, public_keys: frozenset[bytes]) -> str:
        """Name of a new ZAP domain whose sockets accept these keys (Z85)."""
        domain = f"rtctl-{next(self._numbers)}"
        self._known[domain] = frozenset(public_keys)
        return domain

    def _serve(self) -> None:
        try:
            while True:
                self._socket.send_multipart(self._answer(self._socket.recv_multipart()))
        except zmq.ZMQError:  # the context ended
            _doormen.pop(self._context, None)
            self._socket.close()

    def _answer(self, frames: list[bytes]) -> list[bytes]:
        version, number, domain, address, _identity, mechanism, *credentials = frames
        key = z85.encode(credentials[0]) if mechanism == b"CURVE" and credentials else b""
        if key and key in self._known.get(domain.decode(errors="replace"), ()):
            return [version, number, b"200", b"OK", key, b""]
        log.warning("client refused: unknown key", address=address.decode(errors="replace"), key=key.decode())
        return [version, number, b"400", b"unknown key", b"", b""]


_doormen: dict[zmq.Context, Doorman] = {}


def _doorman(context: zmq.Context) -> Doorman:
    if context not in _doormen:
        _doormen[context] = Doorman(context)
    return _doormen[context]


def _paths(name: str, directory: Path | None) -> tuple[Path, Path]:
    if not NAME.fullmatch(name):
        raise UserError(f"'{name}' is no name for keys; use letters, digits, '_', '-' and '.'")
    folder = directory or keys_dir()
    return folder / f"{name}.key", folder / f"{name}.key_secret"


def _write(path: Path, mode: int, comment: str, keys: dict[str, bytes]) -> None:
    lines = [f"# rtctl: {comment}", "curve", *(f'    {name} = "{key.decode()}"' for name, key in keys.items())]
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")


def _read(path: Path) -> tuple[bytes, bytes | None]:
    try:
        public, secret = load_certificate(path)
    except (OSError, ValueError, IndexError):
        raise UserError(f"no key in {path}; copy it there, or make keys with `rtctl keys new`") from None
    for key in (public, secret):
        try:
            if key is not None and len(z85.decode(key)) != 32:
                raise ValueError
        except (ValueError, KeyError, ArithmeticError, IndexError, struct.error):
            raise UserError(f"{path} is damaged: a key in it is not 40 characters of Z85") from None
    return public, secret
