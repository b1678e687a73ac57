"""Simulated shifts on virtual time: random moves of an emulated machine, and an effect that begins in mid-run."""

from typing import Any, NamedTuple

import numpy as np

from rtctl import machines
from rtctl.daemon.case import describe
from rtctl.daemon.onset import carry
from rtctl.loop import fused, generate
from rtctl.loop.loop import Loop
from rtctl.loop.mailbox import Mailbox
from rtctl.loop.ring import Reader
from rtctl.machines.profiles import profile_of

STRETCH = 4096  # ticks: their rows fit into the cache
RECORDS = ("p", "s", "c", "staged", "y", "m", "f", "tx", "rx", "held", "ps")
SHARED = ("status", "mailbox", "tables")


class Moves(NamedTuple):
    """Random setpoints within a given travel and speed, with rests between them."""

    travel: float  # unit of the reference: setpoints lie within it on both sides of zero
    speed: float  # the fastest ramp, unit of the reference a second; the slowest is 1/SLOWEST of it
    jump: float  # unit of the reference: the largest step without a ramp
    rest: float = 0.3  # share of rests among the setpoints
    jumps: float = 0.2  # share of steps among the setpoints


SLOWEST = 12.0
JUMP = 0.1  # of the usual travel, size of a step
SHORTEST, LONGEST = 0.5, 4.0  # s between two setpoints
RESTS = 2.0  # s, mean duration of a rest


def usual(config: Any) -> Moves:
    """Moves of a machine in ordinary use, by its profile. Raises ValueError where the profile has no moves."""
    duty = profile_of(config.kind).duty
    if duty is None:
        raise ValueError(f"{config.name}: no moves are known for a machine of kind {config.kind}")
    return Moves(0.5 * duty.travel, duty.speed, JUMP * duty.travel)


class Shift:
    """An armed machine in this process. `config` runs fused, whatever its mode."""

    def __init__(self, config: Any):
        config = config.model_copy(update={"loop": config.loop.model_copy(update={"mode": "fused"})})
        self.machine = machines.build(config)
        self.made = generate.generate(self.machine, "shm")
        self._segment = fused.segment(self.made, 2 * STRETCH)
        generate.prepare(self._segment, self.machine)
        self._loop = Loop(self.machine, self.made, self._segment, self._segment["outputs"], self._segment["inputs"])
        self._entry, self._arguments = self._loop.entry()
        self._mailbox, self._reader = Mailbox(self._segment), Reader(self._segment)
        self._mailbox.post(_arm)

    @property
    def case(self) -> dict[str, Any]:
        """case.json of a recording of this machine."""
        return describe(self.machine, self.made)

    @property
    def tick(self) -> int:
        """Number of the next tick."""
        return int(self._segment["status"][0]["tick"])

    def setpoint(self, target: float, rate: float) -> None:
        """A new target in the unit of the reference, at `rate` a second."""

        def write(_: Any, command: Any) -> None:
            command["setpoint"]["target"], command["setpoint"]["rate"] = target, rate
            command["setpoint"]["seq"] += 1

        self._target = target
        self._mailbox.post(write)

    _target = 0.0

    def run(self, ticks: int) -> np.ndarray:
        """Rows of the next ticks."""
        out = []
        while ticks > 0:
            most = min(ticks, STRETCH)
            self._entry(*self._arguments[:-2], self.tick, most)
            out.append(self._reader.take())
            ticks -= most
        return np.concatenate(out)

    def play(self, moves: Moves, rng: np.random.Generator, seconds: float) -> np.ndarray:
        """Rows of random moves, for `seconds` at least."""
        rate, out, total = self.machine.rate, [], 0
        while total < seconds * rate:
            kind = rng.random()
            if kind < moves.rest:
                ticks = 1 + int(rng.exponential(RESTS) * rate)
            elif kind < moves.rest + moves.jumps:
                to = self._target + float(rng.uniform(-moves.jump, moves.jump))
                self.setpoint(float(np.clip(to, -moves.travel, moves.travel)), 0.0)
                ticks = int(rng.uniform(SHORTEST, LONGEST) * rate)
            else:
                speed = moves.speed * float(np.exp(-rng.uniform(0.0, np.log(SLOWEST))))
                self.setpoint(float(rng.uniform(-moves.travel, moves.travel)), speed)
                ticks = int(rng.uniform(SHORTEST, LONGEST) * rate)
            out.append(self.run(ticks))
            total += ticks
        return np.concatenate(out)

    def become(self, config: Any) -> "Shift":
        """This machine, in its present state at its present tick, under the equations of another config."""
        other = Shift(config)
        other._entry(*other._arguments[:-2], 0, 1)  # starts the plant; its state is overwritten below
        other._reader.take()
        for name in RECORDS:
            carry(getattr(self._loop, name), getattr(other._loop, name))
        for name in SHARED:
            carry(self._segment[name], other._segment[name])
        other._target = self._target
        return other


def _arm(_: Any, command: Any) -> None:
    command["arm"] += 1
    command["play"] += 1
