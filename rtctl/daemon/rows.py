"""Every row of the trace, as the loop wrote it, for a scope: an XPUB socket beside the telemetry, local only.

A message is three parts: the topic (the machine's name), a msgpack map that says how a row looks and whose it is,
`{"pid": 4711, "names": ["tick", "t", ...], "types": ["<i8", "<f8", ...]}`, and the rows, each of them the values one
after the other. The telemetry is thinned and easy to read; this is neither, and costs a copy of the rows. The daemon
never waits: a subscriber that is slow loses messages, and sees it by a jump in `tick`. Without one nothing is sent.
"""

import os
import stat
from pathlib import Path

import msgpack
import numpy as np
import zmq

from rtctl.daemon.doors import Door
from rtctl.daemon.server import bind, release
from rtctl.daemon.telemetry import LONGEST_TOPIC

MESSAGES_WAITING = 200  # for each subscriber: two seconds of turns
MOST_ROWS = 8192  # in one message; of a run on virtual time that makes more, the newest


class RowsOut:
    """Publishes rows of dtype `row` under `topic`, while somebody listens."""

    def __init__(self, endpoint: str, topic: str, row: np.dtype, context: zmq.Context, door: Door | None = None):
        self.socket = context.socket(zmq.XPUB)
        self.socket.linger = 0
        self.socket.maxmsgsize = LONGEST_TOPIC
        self.socket.sndhwm = MESSAGES_WAITING
        self.endpoint = bind(self.socket, endpoint, door=door)
        path = Path(self.endpoint.removeprefix("ipc://"))
        path.chmod(path.stat().st_mode | stat.S_IRGRP | stat.S_IWGRP)  # who may enter the folder may listen
        self._topic = topic.encode()
        self._packed = packed(row)
        types = [self._packed[name].str for name in self._packed.names or ()]
        self._head = msgpack.packb({"pid": os.getpid(), "names": list(self._packed.names or ()), "types": types})
        self._asked: set[bytes] = set()

    def publish(self, rows: np.ndarray) -> bool:
        """Send an array of rows; returns False where nobody listens."""
        while self.socket.poll(0):
            message = self.socket.recv(zmq.NOBLOCK)
            (self._asked.add if message[:1] == b"\x01" else self._asked.discard)(message[1:])
        if not any(self._topic.startswith(asked) for asked in self._asked):
            return False
        kept = rows[-MOST_ROWS:].astype(self._packed, copy=False)
        self.socket.send_multipart([self._topic, self._head, kept.tobytes()], zmq.NOBLOCK)
        return True

    def close(self) -> None:
        release(self.socket, self.endpoint)


def packed(row: np.dtype) -> np.dtype:
    """The same fields without gaps between them, in the byte order of x86 and ARM."""
    return np.dtype([(name, row[name].newbyteorder("<")) for name in row.names or ()])


def decode(head: bytes) -> tuple[int, np.dtype]:
    """The pid of the daemon and the dtype of its rows. Raises ValueError where `head` is none."""
    try:
        found = msgpack.unpackb(head)
        return int(found["pid"]), np.dtype(list(zip(found["names"], found["types"], strict=True)))
    except (msgpack.UnpackException, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"not the head of a message of rows: {error}") from error
