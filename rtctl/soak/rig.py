"""Rig of a soak in this process, on virtual time: the commands of a command socket, and checked rows.

`rtctl.soak.live` has the same interface for a running supervisor.
"""

from typing import Any, Protocol

from rtctl import machines
from rtctl.config.load import set_path
from rtctl.loop import fused, generate
from rtctl.loop.loop import Loop
from rtctl.loop.mailbox import Mailbox
from rtctl.loop.ring import Reader
from rtctl.machines import Machine
from rtctl.soak.checker import Checker
from rtctl.tick import faults

STRETCH = 4096  # ticks in one block, whose rows fit into the CPU cache


class Rig(Protocol):
    """Interface of a machine to the player of a day."""

    machine: Machine
    checker: Checker
    slack: int  # longest delay of a command, ticks

    @property
    def tick(self) -> int: ...
    @property
    def lost_counts(self) -> int: ...
    def ask(self, request: str) -> None: ...
    def setpoint(self, target: float, rate: float) -> None: ...
    def set(self, path: str, value: float | str) -> None: ...
    def fault(self, settings: faults.FaultSettings) -> faults.Fault: ...
    def run(self, ticks: int) -> None: ...
    def finish(self) -> None: ...


class Fused:
    """Loop and emulated machine in this process. The rows go through ring and reader, as in a daemon."""

    slack = 0

    def __init__(self, config: Any, out: Any, seed: int):
        self.config = config
        self.machine = machines.build(config)
        self.made = generate.generate(self.machine, "shm")
        self.segment = fused.segment(self.made, 2 * STRETCH)
        generate.prepare(self.segment, self.machine)
        self.loop = Loop(self.machine, self.made, self.segment, self.segment["outputs"], self.segment["inputs"])
        self.loop.warm()
        self._entry, self._arguments = self.loop.entry()
        self.mailbox, self.reader = Mailbox(self.segment), Reader(self.segment)
        self.checker = Checker(self.machine, self.made, out, seed)
        self.status = self.segment["status"][0]
        self._built: dict[tuple[str, float | str], Machine] = {}

    @property
    def tick(self) -> int:
        return int(self.status["tick"])

    @property
    def lost_counts(self) -> int:
        """Counts that the emulated quadrature converter has lost since the start."""
        return int(self.status["lost_counts"])

    def _post(self, write: Any) -> int:
        self.mailbox.post(write)
        order = int(self.segment["mailbox"][0]["command"]["order"])
        self.checker.windows["newest"] = order
        return order

    def ask(self, request: str) -> None:
        """Post the command arm, disarm, reset or play."""

        def write(_: Any, command: Any) -> None:
            command[request] += 1

        order = self._post(write)
        if request != "play":
            self.checker.windows[request] = order

    def setpoint(self, target: float, rate: float) -> None:
        """Set a new target in the unit of the reference, reached at `rate` per second, or at once for rate 0."""

        def write(_: Any, command: Any) -> None:
            command["setpoint"]["target"], command["setpoint"]["rate"] = target, rate
            command["setpoint"]["seq"] += 1

        self._post(write)

    def set(self, path: str, value: float | str) -> None:
        """Set one setting of the law, with the others as in the config; in force from a tick on, bumpless."""
        key = (path, value)
        if key not in self._built:
            self._built[key] = machines.build(set_path(self.config, path, value))
        blocks = self._built[key].diagram.blocks

        def write(params: Any, command: Any) -> None:
            generate.fill(params, blocks)
            command["gains"] += 1

        self._post(write)

    def fault(self, settings: faults.FaultSettings) -> faults.Fault:
        """Add a fault, with its time counted from now; faults that have ended are removed."""
        made = faults.build(settings, self.machine.dt, self.tick, self.machine.diagram.blocks)
        kept = [f for f in faults.in_force(self.segment["mailbox"][0]["command"]) if f.end > self.tick]
        self._post(lambda _, c: faults.fill(c, [*kept, made]))
        return made

    def run(self, ticks: int) -> None:
        """Run `ticks` ticks of virtual time, and check every row."""
        while ticks > 0:
            most = min(ticks, STRETCH)
            self._entry(*self._arguments[:-2], self.tick, most)
            rows = self.reader.take()
            for first, count in self.reader.gaps:
                self.checker.note_lost(first, count)
            self.checker.feed(rows)
            ticks -= most
        self.checker.account(self.tick)

    def finish(self) -> None:
        """Nothing to do: `run` has checked every row."""
