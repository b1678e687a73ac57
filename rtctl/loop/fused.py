"""A machine run on virtual time inside this process: no sockets, no children, no clock.

What experiments, designs and tests use where they need a run of a machine as it would be recorded, and nothing else.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.loop import generate
from rtctl.loop.loop import Loop
from rtctl.loop.records import layout
from rtctl.tick import safety


@dataclass(frozen=True, eq=False)
class Run:
    """Rows of a run, one a tick, with the columns of the recording; and the loop as it stands at its end."""

    rows: np.ndarray
    loop: Loop

    def __getitem__(self, column: str) -> np.ndarray:
        return np.asarray(self.rows[column])

    @property
    def start(self) -> float:
        """Seconds from arming to running, when the reference begins to play."""
        return float(self.rows["t"][np.argmax(self.rows["state"] == safety.RUNNING)])

    def between(self, begin: float, end: float) -> np.ndarray:
        """Rows of `begin` to `end` s of the reference."""
        t = self.rows["t"] - self.start
        return self.rows[(t > begin - 1e-9) & (t < end - 1e-9)]

    @property
    def tripped(self) -> str:
        """Name of the trip that ended it, "" for none."""
        cause = int(self.rows["trip"][-1])
        return "" if cause == safety.NONE else safety.TRIPS[cause][0]

    @property
    def trip_time(self) -> float:
        """Controller clock at the trip that ended it, s; nan for none."""
        causes = np.flatnonzero(self.rows["trip"])
        return float(self.rows["t"][causes[0]]) if len(causes) else float("nan")


def run(config: Any, seconds: float) -> Run:
    """Arm and play a config from the first tick on, for `seconds`; `loop.mode` has to be fused.

    Raises ValueError where the settings contradict each other.
    """
    machine = machines.build(config)
    return play(machine, generate.generate(machine, "shm"), round(seconds * machine.rate))


def play(machine: machines.Machine, made: generate.Generated, ticks: int) -> Run:
    """As `run`, with a module that was generated for a machine of the same structure."""
    arrays = segment(made, ticks)
    generate.prepare(arrays, machine)
    loop = Loop(machine, made, arrays, arrays["outputs"], arrays["inputs"])
    loop.c["arm"] = loop.c["play"] = loop.c["order"] = 1  # an order as of a person, so that a bundle can be replayed
    loop.stretch(0, ticks)
    return Run(arrays["rows"], loop)


def segment(made: generate.Generated, rows: int) -> Any:
    """What loop and supervisor share, as arrays of this process alone; `rows` is the length of the ring."""
    records = layout(made.params, made.tables, made.row, rows)
    return {name: np.zeros(count, dtype) for name, (dtype, count) in records.items()}
