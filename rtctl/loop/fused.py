"""Run of a machine on virtual time inside this process, without sockets, child processes or clock.

Experiments, designs and tests use it for the rows of a run as they would be recorded.
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
    """Rows of a run (ticks,), with the columns of a recording, and the loop after the last tick."""

    rows: np.ndarray
    loop: Loop

    def __getitem__(self, column: str) -> np.ndarray:
        return np.asarray(self.rows[column])

    @property
    def start(self) -> float:
        """Controller time in s of the first tick in state `running`, when the reference begins to play."""
        return float(self.rows["t"][np.argmax(self.rows["state"] == safety.RUNNING)])

    def between(self, begin: float, end: float) -> np.ndarray:
        """Rows from `begin` to `end`, s of the reference's time."""
        t = self.rows["t"] - self.start
        return self.rows[(t > begin - 1e-9) & (t < end - 1e-9)]

    @property
    def tripped(self) -> str:
        """Code of the trip in the last row, "" for none."""
        cause = int(self.rows["trip"][-1])
        return "" if cause == safety.NONE else safety.TRIPS[cause][0]

    @property
    def trip_time(self) -> float:
        """Controller time at the first row with a trip, s; nan for none."""
        causes = np.flatnonzero(self.rows["trip"])
        return float(self.rows["t"][causes[0]]) if len(causes) else float("nan")


def run(config: Any, seconds: float) -> Run:
    """Run of a config that is armed and played from the first tick on, for `seconds` s; `loop.mode` must be fused.

    Raises ValueError where the settings contradict each other.
    """
    machine = machines.build(config)
    return play(machine, generate.generate(machine, "shm"), round(seconds * machine.rate))


def play(machine: machines.Machine, made: generate.Generated, ticks: int) -> Run:
    """As `run`, for `ticks` ticks of a machine, with a module generated for a machine of the same structure."""
    arrays = segment(made, ticks)
    generate.prepare(arrays, machine)
    loop = Loop(machine, made, arrays, arrays["outputs"], arrays["inputs"])
    loop.c["arm"] = loop.c["play"] = loop.c["order"] = 1  # as a person's command, for a replay
    loop.stretch(0, ticks)
    return Run(arrays["rows"], loop)


def segment(made: generate.Generated, rows: int) -> Any:
    """Records of a shared segment as arrays of this process; `rows` is the length of the ring."""
    records = layout(made.params, made.tables, made.row, rows)
    return {name: np.zeros(count, dtype) for name, (dtype, count) in records.items()}
