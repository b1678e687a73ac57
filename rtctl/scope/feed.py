"""Data feed of the scope: rows from the daemon's rows socket, status and commands through a client."""

import asyncio
import contextlib
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client, listens
from rtctl.daemon.log import log
from rtctl.daemon.rows import MESSAGES_WAITING, decode
from rtctl.daemon.server import find_endpoint
from rtctl.scope.history import MOST_ROWS, MOST_SECONDS, History
from rtctl.scope.lanes import Lanes

TIMEOUT = 1.0  # s to wait for an answer of the daemon
EDGES_US = [2.0**k for k in range(-2, 15)]  # bin edges of the lateness histogram, us


class Feed:
    """Feed of the machine `name`, also after restarts of its daemon. Use in one event loop.

    `run` counts the daemons seen; `history` holds the rows of the current one. `alive` is whether the daemon answers,
    `there` whether its socket exists: a starting daemon has a socket long before it answers.
    """

    def __init__(self, name: str):
        self.name = name
        self.run = 0
        self.alive = self.there = False
        self.rate = 0.0
        self.signals: list[dict[str, str]] = []
        self.history: History | None = None
        self.lanes = Lanes()
        self.status: dict[str, Any] = {}
        self.lateness = np.zeros(len(EDGES_US) + 1, np.int64)
        self._head = b""
        self._row: np.dtype | None = None
        self._context = zmq.Context()
        self._rows = self._context.socket(zmq.SUB)
        self._rows.linger, self._rows.rcvhwm, self._rows.reconnect_ivl = 0, MESSAGES_WAITING, 50
        self._rows.subscribe(name)
        self._rows_at = find_endpoint(name, "rows")
        self._rows.connect(self._rows_at)
        self._client = Client(find_endpoint(name, "command"), timeout=TIMEOUT, context=self._context)
        self._thread = ThreadPoolExecutor(1, "daemon")  # a client is for one thread

    async def call(self, op: str, **args: Any) -> dict[str, Any]:
        """Ask the daemon in a thread, so that frames are not delayed. Raises UserError as Client.call does."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, lambda: self._client.call(op, **args))

    async def look(self) -> None:
        """Ask the daemon for its status; ask a new daemon also for its signals."""
        try:
            self.status = self._without_lanes(await self.call("status"))
            if not self.signals:
                self._follow()
                self.signals = (await self.call("signals"))["signals"]
            self._show_lanes()
            self.alive, self.there, self.rate = True, True, float(self.status["rate_hz"])
        except UserError:
            self.alive, self.signals = False, []
            self.there = await asyncio.get_running_loop().run_in_executor(self._thread, self._find)

    def _without_lanes(self, status: dict[str, Any]) -> dict[str, Any]:
        """Copy of a status without the lanes of its model, which are stored in `lanes`."""
        model = status.get("model")
        self.lanes.take(model)
        return status if model is None else {**status, "model": {**model, "t": [], "lanes": {}}}

    def _show_lanes(self) -> None:
        """Add new lanes to the signals and the history."""
        known = {signal["name"] for signal in self.signals}
        new = [signal for signal in self.lanes.signals if signal["name"] not in known]
        if self.history is not None and new:
            self.history.extend(tuple(signal["name"] for signal in new))
            self.signals = [*self.signals, *new]

    def drain(self) -> int:
        """Store all waiting rows in the history; returns their number."""
        taken = 0
        with contextlib.suppress(zmq.Again):
            while True:
                parts = self._rows.recv_multipart(zmq.NOBLOCK)
                try:
                    taken += self._take(*parts)
                except (TypeError, ValueError) as error:
                    log.warning("not a message of rows", error=str(error))
        return taken

    def _find(self) -> bool:
        """Whether a process listens at the daemon's socket: the user's own daemon, or a system service."""
        at = find_endpoint(self.name, "command")
        if at != self._client.endpoint:
            self._client.close()
            self._client.endpoint = at
        return listens(at)

    def _follow(self) -> None:
        """Connect to the rows socket at its current address."""
        at = find_endpoint(self.name, "rows")
        if at != self._rows_at:
            self._rows.disconnect(self._rows_at)
            self._rows.connect(at)
            self._rows_at = at

    def _take(self, topic: bytes, head: bytes, payload: bytes) -> int:
        """Store the rows of one message; returns their number. Raises ValueError or TypeError if malformed."""
        if topic != self.name.encode():
            return 0  # another machine whose name begins with this name
        if head != self._head:
            self._begin(head)
        if self.history is None or self._row is None:
            return 0
        rows = np.frombuffer(payload, self._row)
        beside = [name for name in self.lanes.names if name in self.history.index]
        self.history.append(rows, self.lanes.at(rows["t"], beside) if beside else None)
        self._count(rows)
        return len(rows)

    def close(self) -> None:
        self._thread.shutdown()
        self._client.close()
        self._rows.close()
        self._context.term()

    def _begin(self, head: bytes) -> None:
        """Begin a new run and history with the first rows of a daemon."""
        if not self.signals or not self.rate:
            return  # wait for the rate
        pid, self._row = decode(head)
        if pid != self.status.get("pid"):
            self.signals = []  # of the previous daemon; look() asks the new one
            self.history, self.lanes = None, Lanes()
            return
        self._head = head
        capacity = int(min(MOST_ROWS, MOST_SECONDS * self.rate))
        self.history = History(self._row, max(capacity, 1000))
        self.lateness[:] = 0
        self.run += 1

    def _count(self, rows: np.ndarray) -> None:
        if "lateness" in (rows.dtype.names or ()):
            bins = np.searchsorted(EDGES_US, rows["lateness"] * 1e6, side="right")
            self.lateness += np.bincount(bins, minlength=len(self.lateness))
