"""Telemetry: signals of a running machine on a PUB socket, in the format of PlotJuggler.

A message is two parts, the topic and a msgpack list of rows: `[{"timestamp": t, name: value, ...}, ...]`. The daemon
publishes the new rows once in `commands.telemetry_period` (20 ms). It never waits: a slow subscriber loses messages.

Source: PlotJuggler's ZeroMQ subscriber takes topic and payload as two parts (its pull request 951), its MessagePack
parser a list of rows since February 2026 (1285); before that, one row a message. No third part with the time: a
version with that part drops the payload (1416).
"""

import stat
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import zmq

from rtctl.daemon.doors import Door
from rtctl.daemon.keys import ServerCurve
from rtctl.daemon.server import bind, release

MESSAGES_WAITING = 20  # queued messages for each subscriber: a few tenths of a second
LONGEST_TOPIC = 1024  # bytes of a subscription; a longer one ends the connection


class Telemetry:
    """Publishes rows of `columns` under `topic`. `sent` counts rows published, `thinned` rows left out.

    `max_rows_per_message` limits the work and the traffic at high rates. Without `batch` each row is a separate
    message, a map instead of a list, for older versions of PlotJuggler.
    """

    def __init__(
        self,
        endpoint: str,
        topic: str,
        columns: Sequence[str],
        context: zmq.Context,
        *,
        max_rows_per_message: int = 50,
        batch: bool = True,
        curve: ServerCurve | None = None,
        door: Door | None = None,
    ):
        if max_rows_per_message < 1:
            raise ValueError(f"max_rows_per_message is {max_rows_per_message}; at least 1 row must go out")
        names = ("timestamp", *columns)
        if len(set(names)) < len(names):
            raise ValueError(f"a name stands twice in {', '.join(names)}; the first, timestamp, is the time")
        self.sent = 0
        self.thinned = 0
        self._topic = topic.encode()
        self._names = names
        self._max_rows = max_rows_per_message
        self._batch = batch
        self.socket = context.socket(zmq.PUB)
        self.socket.linger = 0
        self.socket.maxmsgsize = LONGEST_TOPIC
        self.socket.sndhwm = MESSAGES_WAITING * (1 if batch else max_rows_per_message)
        self.endpoint = bind(self.socket, endpoint, curve, door)
        if self.endpoint.startswith("ipc://"):  # group members may subscribe, but not command
            path = Path(self.endpoint.removeprefix("ipc://"))
            path.chmod(path.stat().st_mode | stat.S_IRGRP | stat.S_IWGRP)

    def publish(self, rows: np.ndarray) -> int:
        """Send an array (rows, 1 + columns) whose first column is the time in s; returns the number of rows sent.

        Of more than `max_rows_per_message` rows every n-th is sent, and always the newest, so that a plot has no gaps.
        Thinned rows alias; a recording has all rows. Raises ValueError where the shape does not match the columns.
        """
        if rows.ndim != 2 or rows.shape[1] != len(self._names):
            raise ValueError(f"rows of shape {rows.shape} for {len(self._names)} names: {', '.join(self._names)}")
        kept = thin(rows, self._max_rows)
        if not len(kept):
            return 0
        maps = [dict(zip(self._names, row, strict=True)) for row in kept.tolist()]
        for payload in [maps] if self._batch else maps:
            self._send(payload)
        self.sent += len(kept)
        self.thinned += len(rows) - len(kept)
        return len(kept)

    def close(self) -> None:
        release(self.socket, self.endpoint)

    def _send(self, payload: Any) -> None:
        self.socket.send_multipart([self._topic, msgpack.packb(payload)], zmq.NOBLOCK)


def thin(rows: np.ndarray, max_rows: int) -> np.ndarray:
    """View of every n-th row counted back from the newest, with the smallest n that leaves at most `max_rows`."""
    stride = max(1, -(-len(rows) // max_rows))
    return rows[::-1][::stride][::-1]
