"""The daemon as the scope sees it: rows from its rows socket, status and commands through an ordinary client."""

import asyncio
import contextlib
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import structlog
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client, listens
from rtctl.daemon.rows import MESSAGES_WAITING, decode
from rtctl.daemon.server import find_endpoint
from rtctl.scope.history import MOST_ROWS, MOST_SECONDS, History
from rtctl.scope.lanes import Lanes

log = structlog.get_logger()
TIMEOUT = 1.0  # s for an answer of the daemon
EDGES_US = [2.0**k for k in range(-2, 15)]  # of the lateness histogram


class Feed:
    """Follows the machine `name`, through restarts of its daemon. Use in one event loop.

    `run` counts up with each daemon that is met; `history` holds its rows. `alive` says whether it answers, `there`
    whether its socket is there: a daemon that starts has one long before it answers.
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
        """Ask the daemon, without holding up the frames. Raises UserError as Client.call does."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, lambda: self._client.call(op, **args))

    async def look(self) -> None:
        """Ask for the status; of a daemon that was not there before, for its signals as well."""
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
        """A status whose model says no lanes any more: they are taken in."""
        model = status.get("model")
        self.lanes.take(model)
        return status if model is None else {**status, "model": {**model, "t": [], "lanes": {}}}

    def _show_lanes(self) -> None:
        """Lanes that have come are signals as others are."""
        known = {signal["name"] for signal in self.signals}
        new = [signal for signal in self.lanes.signals if signal["name"] not in known]
        if self.history is not None and new:
            self.history.extend(tuple(signal["name"] for signal in new))
            self.signals = [*self.signals, *new]

    def drain(self) -> int:
        """Take in the rows that have come; returns how many."""
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
        """Whether somebody listens where the daemon's socket would be: ours, or by now that of a system service."""
        at = find_endpoint(self.name, "command")
        if at != self._client.endpoint:
            self._client.close()
            self._client.endpoint = at
        return listens(at)

    def _follow(self) -> None:
        """Take the rows from where the daemon is now."""
        at = find_endpoint(self.name, "rows")
        if at != self._rows_at:
            self._rows.disconnect(self._rows_at)
            self._rows.connect(at)
            self._rows_at = at

    def _take(self, topic: bytes, head: bytes, payload: bytes) -> int:
        """Take in one message. Raises ValueError or TypeError where it is none of a daemon."""
        if topic != self.name.encode():
            return 0  # of a machine whose name only begins like this one's
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
        """Rows of another daemon, or the first ones: what was there before belongs to another run."""
        if not self.signals or not self.rate:
            return  # not before we know its rate
        pid, self._row = decode(head)
        if pid != self.status.get("pid"):
            self.signals = []  # of the one before; look() asks the new one
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
