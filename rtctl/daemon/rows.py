"""Rows socket: every row of the trace for a scope, on an XPUB socket of this computer.

A message has three parts. The first is the topic, the machine's name. The second is a msgpack map with the daemon's pid
and the row layout, `{"pid": 4711, "names": ["tick", "t", ...], "types": ["<i8", "<f8", ...]}`. The third holds the
rows, each as its values one after the other. The daemon never waits: a slow subscriber loses messages, and sees the
loss as a jump in `tick`. Without a subscriber nothing is sent.
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

MESSAGES_WAITING = 200  # queued messages for each subscriber: two seconds of turns
MOST_ROWS = 8192  # rows in one message, the newest; a run on virtual time may make more in a turn


class RowsOut:
    """Publishes rows of dtype `row` under `topic`, while there is a subscriber."""

    def __init__(self, endpoint: str, topic: str, row: np.dtype, context: zmq.Context, door: Door | None = None):
        self.socket = context.socket(zmq.XPUB)
        self.socket.linger = 0
        self.socket.maxmsgsize = LONGEST_TOPIC
        self.socket.sndhwm = MESSAGES_WAITING
        self.endpoint = bind(self.socket, endpoint, door=door)
        path = Path(self.endpoint.removeprefix("ipc://"))
        path.chmod(path.stat().st_mode | stat.S_IRGRP | stat.S_IWGRP)  # the group may subscribe
        self._topic = topic.encode()
        self._packed = packed(row)
        types = [self._packed[name].str for name in self._packed.names or ()]
        self._head = msgpack.packb({"pid": os.getpid(), "names": list(self._packed.names or ()), "types": types})
        self._asked: set[bytes] = set()

    def publish(self, rows: np.ndarray) -> bool:
        """Send rows (n,); returns False where there is no subscriber."""
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
    """Row dtype without padding, in little-endian byte order."""
    return np.dtype([(name, row[name].newbyteorder("<")) for name in row.names or ()])


def decode(head: bytes) -> tuple[int, np.dtype]:
    """The pid of the daemon and the dtype of its rows, from the second part `head`. Raises ValueError if malformed."""
    try:
        found = msgpack.unpackb(head)
        return int(found["pid"]), np.dtype(list(zip(found["names"], found["types"], strict=True)))
    except (msgpack.UnpackException, KeyError, TypeError, ValueError) as error:
        raise ValueError(f"not the head of a message of rows: {error}") from error
