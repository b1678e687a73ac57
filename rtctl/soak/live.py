"""Rig of a soak on a running supervisor: its commands, and the rows that it reads.

Events are carried out at turns of the supervisor, so a day is not repeatable to the bit. The invariants are unchanged.
"""

import contextlib
import time
from pathlib import Path
from typing import Any

import numpy as np
import zmq

from rtctl.config.errors import UserError
from rtctl.config.load import get_path
from rtctl.daemon.protocol import OPS
from rtctl.daemon.supervisor import Supervisor
from rtctl.soak.checker import Checker
from rtctl.tick import faults

HANG = 60.0  # s without a new row, after which the loop has hung


class Live:
    """Context with a supervisor in this process, and its loop and plant as child processes.

    `slack` is the longest delay of a command, in ticks of the loop.
    """

    def __init__(self, config: Any, out: Path, seed: int):
        self.supervisor = Supervisor(config, None)
        self.machine, self.made = self.supervisor.machine, self.supervisor.made
        self.checker = Checker(self.machine, self.made, out, seed)
        self.slack = round((0.5 if config.loop.mode == "lockstep" else 0.1) * self.machine.rate)
        self._config = config
        self._changed: str | None = None
        self._poller = zmq.Poller()

    def __enter__(self) -> "Live":
        self.supervisor.__enter__()
        self._poller.register(self.supervisor.server.socket, zmq.POLLIN)
        captures, checker = self.supervisor.captures, self.checker
        feed, note_lost = captures.feed, captures.note_lost

        def tee(rows: np.ndarray) -> None:
            checker.feed(rows)
            feed(rows)

        def tee_lost(first: int, count: int) -> None:
            checker.note_lost(first, count)
            note_lost(first, count)

        captures.feed, captures.note_lost = tee, tee_lost  # type: ignore[method-assign]
        return self

    def __exit__(self, *error: Any) -> None:
        self.supervisor.__exit__(*error)

    @property
    def tick(self) -> int:
        """Number of the next row to check; the loop may be ahead."""
        return int(self.checker.carry["tick"])

    @property
    def lost_counts(self) -> int:
        return int(self.supervisor.status["lost_counts"])

    def _handle(self, op: str, **args: Any) -> dict[str, Any]:
        try:
            return self.supervisor.commands.handle(op, OPS[op].model_validate(args))
        finally:
            self.checker.windows["newest"] = self._order

    @property
    def _order(self) -> int:
        return int(self.supervisor.segment["mailbox"][0]["command"]["order"])

    def ask(self, request: str) -> None:
        """Send the command arm, disarm, reset or play."""
        with contextlib.suppress(UserError):  # refused after a trip; the checker sees the trip
            self._handle(request)
            if request != "play":
                self.checker.windows[request] = self._order

    def setpoint(self, target: float, rate: float) -> None:
        """Set a new target in the unit of the reference, reached at `rate` per second, or at once for rate 0."""
        with contextlib.suppress(UserError):
            self._handle("setpoint", value=target, ramp=rate or None)

    def set(self, path: str, value: float | str) -> None:
        """Set one setting of the law; a setting changed before returns to its value in the config."""
        if self._changed is not None and self._changed != path:
            self._handle("set", path=self._changed, value=get_path(self._config, self._changed))
        self._handle("set", path=path, value=value)
        self._changed = path

    def fault(self, settings: faults.FaultSettings) -> faults.Fault:
        """Add a fault, with its time counted from now."""
        answer = self._handle("fault", action="add", fault=settings.model_dump(exclude_none=True))
        return faults.build(settings, self.machine.dt, int(answer["tick"]), self.machine.diagram.blocks)

    def run(self, ticks: int) -> None:
        """Take turns of the supervisor until `ticks` more rows are checked. Raises RuntimeError where no rows come."""
        goal, seen, heard = self.tick + ticks, self.tick, time.monotonic()
        while self.tick < goal:
            if not self.supervisor.turn():
                raise self.supervisor.failure or RuntimeError(
                    f"the loop ended at tick {self.tick}, in the middle of the soak"
                )
            if self.tick != seen:
                seen, heard = self.tick, time.monotonic()
            elif time.monotonic() - heard > HANG:
                raise RuntimeError(f"no row has come for {HANG:g} s, since tick {seen}")
            self._poller.poll(1)

    def finish(self) -> None:
        """Stop the loop, check its last rows, and check that none is missing."""
        self.supervisor.stop()
        self.checker.account(int(self.supervisor.status["tick"]))
