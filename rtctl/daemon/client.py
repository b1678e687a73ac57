"""Client of the command socket: one call, one answer, or a UserError."""

import itertools
import os
import socket as sockets
import time
from types import TracebackType
from typing import Any

import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.keys import ClientCurve, apply_client, refuse_open, require_curve
from rtctl.daemon.protocol import ProtocolError, Reply, decode_reply, encode_request


class CommandError(UserError):
    """The daemon answered with an error; `code` is one of protocol.ERRORS."""

    def __init__(self, code: str, message: str):
        super().__init__(message)
        self.code = code


class Client:
    """Calls the daemon at `endpoint`, waiting at most `timeout` s for each answer. Not for use from several threads.

    A request is sent only over an existing connection (IMMEDIATE). Without an answer the request is dropped with the
    socket. So no daemon that starts an hour later carries out an old command.
    """

    def __init__(
        self,
        endpoint: str,
        timeout: float = 2.0,
        curve: ClientCurve | None = None,
        context: zmq.Context | None = None,
    ):
        if curve is None and require_curve(endpoint):
            raise refuse_open(endpoint)
        self.endpoint = endpoint
        self.timeout = timeout
        self.curve = curve
        self._context = context or zmq.Context.instance()
        self._ids = itertools.count(1)
        self._socket: zmq.Socket | None = None

    def call(self, op: str, **args: Any) -> dict[str, Any]:
        """The result of `op`. Raises CommandError for an error reply, UserError where no daemon answers."""
        id = f"{os.getpid()}-{next(self._ids)}"
        try:
            request = encode_request(id, op, args)
        except (ProtocolError, TypeError, ValueError, OverflowError) as error:
            raise UserError(f"'{op}' cannot be sent: {error}") from None
        try:
            reply = self._exchange(id, request)
        except (zmq.ZMQError, ProtocolError) as error:
            self.close()
            raise UserError(f"{self.endpoint} does not answer as a daemon: {error}") from None
        except BaseException:
            self.close()
            raise
        if reply.code:
            raise CommandError(reply.code, reply.message)
        return reply.result

    def close(self) -> None:
        """Drop the connection and unsent requests. The next call connects again."""
        if self._socket is not None:
            self._socket.close(linger=0)
            self._socket = None

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _exchange(self, id: str, request: bytes) -> Reply:
        socket = self._connected()
        deadline = time.monotonic() + self.timeout
        if not socket.poll(_left_ms(deadline), zmq.POLLOUT):
            keys = ", or it does not know our key" if self.curve else ""
            raise UserError(f"no daemon answers at {self.endpoint} (start one with `rtctl run`){keys}")
        socket.send(request, zmq.NOBLOCK)
        while socket.poll(_left_ms(deadline), zmq.POLLIN):
            reply = decode_reply(socket.recv_multipart()[-1])
            if reply.id in (id, None):  # another id belongs to an earlier call that timed out
                return reply
        raise UserError(
            f"the daemon at {self.endpoint} did not answer within {self.timeout:g} s; it may still do what was asked"
        )

    def _connected(self) -> zmq.Socket:
        if self._socket is None:
            self._socket = socket = self._context.socket(zmq.DEALER)
            socket.linger = 0
            socket.immediate = True
            socket.reconnect_ivl = 20
            socket.ipv6 = "[" in self.endpoint
            if self.curve is not None:
                apply_client(socket, self.curve.keys, self.curve.server)
            socket.connect(self.endpoint)
        return self._socket


def _left_ms(deadline: float) -> int:
    return max(0, round((deadline - time.monotonic()) * 1000))


def listens(endpoint: str) -> bool:
    """Whether a process listens at an ipc or tcp endpoint, even one too busy to answer."""
    family: Any = sockets.AF_UNIX
    address: Any = endpoint.removeprefix("ipc://")
    if endpoint.startswith("tcp://"):
        host, _, port = endpoint.removeprefix("tcp://").rpartition(":")
        host = host.strip("[]")
        family, address = (sockets.AF_INET6 if ":" in host else sockets.AF_INET), (host, int(port))
    with sockets.socket(family, sockets.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(address)
        except PermissionError:
            return True  # a socket of another user
        except OSError:
            return False
        return True
