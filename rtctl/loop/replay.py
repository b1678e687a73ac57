"""Replay of a machine's tick on a recording: recorded readings in, recomputed rows out.

The module is generated as for the loop, except for the stage `read`, which takes its signals from the recorded rows. So
the law, its states and its limits are those of the machine, to the bit.
"""

import re
from typing import Any

import numpy as np

from rtctl.loop import generate, mailbox
from rtctl.loop.records import MARKS
from rtctl.machines import Machine
from rtctl.tick import safety

tick: Any = None  # the generated tick, whose `rx` is a recorded row
ASSIGNED = re.compile(r"^y\.(\w+) = ", re.MULTILINE)


def read_columns(machine: Machine) -> tuple[str, ...]:
    """Names of the signals that a replay takes from the recorded rows: readings of sensors, truth of an emulator."""
    read = next(lines for name, lines in machine.diagram.stages if name == "read")
    return (*ASSIGNED.findall("\n".join(read)), *(c.name for c in machine.truth))


def written_columns(machine: Machine) -> tuple[str, ...]:
    """Names of the output voltages that the tick writes."""
    write = next(lines for name, lines in machine.diagram.stages if name == "write")
    return tuple(name for name in ASSIGNED.findall("\n".join(write)) if name.startswith("u"))


def source(machine: Machine) -> str:
    """Text of the generated module."""
    taken = tuple(f"y.{name} = rx.{name}" for name in read_columns(machine))
    stages = tuple((name, taken if name == "read" else lines) for name, lines in machine.diagram.stages)
    traced = tuple(lines for lines in generate.extras(machine) if lines[0] == "traced state")
    body = generate.function(
        "tick",
        "p, s, t, c, rx, tx, y, m, k, fresh, late, passed, gone",
        "One tick on a recorded row.",
        (*stages, *traced),
    )
    head = generate.header(machine, f"The tick of {machine.kind} on a recording.", machine.diagram.uses)
    return "\n\n".join([head.strip("\n") + "\n", body + "\n", generate.copied(run, "entry")])


def run(recorded, rows, p, s, tables, c, tx, y, m, late_ns, period):
    """Run the tick on each of the recorded rows (n,), and write the resulting rows to `rows` (n,)."""
    for k in range(len(recorded)):
        r = recorded[k]
        y[0].tick, y[0].t, y[0].period, y[0].lateness = r.tick, r.t, r.period, r.lateness
        fresh = 1 if r.link_age == 0.0 else 0
        late = 1 if np.round(r.lateness * 1e9) > late_ns else 0
        passed = 1 + int(np.round(r.lateness * 1e9)) // period
        gone = (
            int(r.trip) if r.trip == safety.COMMANDER or r.trip == safety.SUPERVISOR else 0
        )  # causes that the loop itself had found
        tick(p[0], s[0], tables[c[0].table], c[0], r, tx[0], y[0], m[0], r.tick, fresh, late, passed, gone)
        rows[k] = y[0]


class Replay:
    """Replay of a machine from the first tick on: its law with parameters, states and commands."""

    def __init__(self, machine: Machine):
        path = generate.write_text(machine.kind, source(machine))
        self._run = generate.load(path).run
        blocks = machine.diagram.blocks
        self.row = generate.row_dtype(machine)
        self.p = np.zeros(1, generate.params_dtype(blocks))
        self.s = np.zeros(1, generate.state_dtype(blocks))
        self.c = np.zeros(1, mailbox.COMMAND)
        self._y, self._m, self._tx = np.zeros(1, self.row), np.zeros(1, MARKS), generate.new_frames()["tx"]
        self._tables = np.zeros(2, generate.tables_dtype(machine))
        self._period = round(1e9 / machine.rate)
        self._late_ns = int(machine.config.loop.late * self._period)
        generate.fill_tables(self._tables[0], (machine.reference, machine.excitation))
        self.use(machine)

    def use(self, machine: Machine) -> None:
        """Use the parameters of `machine`, which must have the same structure."""
        generate.fill(self.p[0], machine.diagram.blocks)

    def over(self, recorded: np.ndarray) -> np.ndarray:
        """Recomputed rows (n,) for the recorded rows (n,), which must follow the rows of the previous call."""
        rows = np.zeros(len(recorded), self.row)
        self._run(
            recorded, rows, self.p, self.s, self._tables, self.c, self._tx, self._y, self._m,
            self._late_ns, self._period,
        )  # fmt: skip
        return rows
