"""Rows of a running machine for a watch: a tap on its ring, found again when the machine is restarted.

The tap only reads shared memory, so that a watch cannot delay the loop.
"""

import json
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.daemon import shared_memory
from rtctl.daemon.client import Client
from rtctl.daemon.tap import Tap

LOOK = 1.0  # s between two searches for a daemon that has gone
STILL = 3.0  # s of the wall clock without a row, after which the rows count as missing


class Taken(NamedTuple):
    """Result of one read of the ring."""

    rows: np.ndarray | None  # None where there is no machine
    lost: int = 0
    begun: bool = False  # whether the rows are of another run than the last rows
    notes: tuple[str, ...] = ()


class Source:
    """Rows of the machine that `client` commands, by `take`. `case` is the case of its recordings."""

    def __init__(self, client: Client, clock: Callable[[], float] = time.monotonic):
        self._client, self._clock = client, clock
        self._tap: Tap | None = None
        self._pid: int | None = None
        self._lost = 0
        self._heard = self._looked = clock()
        self._still = False
        self.case: dict[str, Any] = {}
        self.status: dict[str, Any] = {}

    def begin(self) -> None:
        """Find the ring. Raises UserError where no daemon answers or its ring cannot be read."""
        self.status = self._client.call("status")
        ring = self._client.call("signals")["ring"]
        try:
            self._tap = Tap(ring)
            about = shared_memory.segment_path(self.status["name"]).with_suffix(shared_memory.ABOUT)
            self.case = json.loads(about.read_text("utf-8"))["case"]
        except (OSError, ValueError, KeyError) as error:
            raise UserError(
                f"{ring['path']}: the rows are out of reach ({error}); run this on the machine of the daemon and as "
                "its user"
            ) from None
        self._pid, self._lost, self._heard, self._still = self.status["pid"], 0, self._clock(), False

    def take(self) -> Taken:
        """Rows since the last call, oldest first, with the number of rows lost before them."""
        now = self._clock()
        if self._tap is None:
            return self._again(now)
        rows = self._tap.take()
        lost, self._lost = self._tap.lost - self._lost, self._tap.lost
        if len(rows):
            self._heard, self._still = now, False
            return Taken(rows, lost)
        if now - self._heard < STILL or now - self._looked < LOOK:
            return Taken(rows)
        self._looked = now
        try:
            status = self._client.call("status")
        except UserError as error:
            self._tap = None
            return Taken(None, notes=(f"the machine has gone, or its daemon is busy: {error}",))
        if status["pid"] != self._pid:
            return self._again(now)
        if self._still:
            return Taken(rows)
        self._still = True
        return Taken(rows, notes=(f"no rows for {now - self._heard:.0f} s: the loop stands, or its rows are lost",))

    def _again(self, now: float) -> Taken:
        """Rows of the daemon that answers now, if one does."""
        if now - self._looked < LOOK:
            return Taken(None)
        self._looked, before = now, self._pid
        try:
            self.begin()
        except UserError:
            return Taken(None)
        assert self._tap is not None
        if self._pid == before:
            return Taken(self._tap.take(), notes=("the daemon answers again; it had been busy",))
        note = f"the machine was started anew, pid {self._pid}; the model begins with it"
        return Taken(self._tap.take(), begun=True, notes=(note,))
