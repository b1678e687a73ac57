"""A machine run in fused mode inside the test's own process: no sockets, no children, no clock."""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.cli import common
from rtctl.daemon.loop_process import Loop
from rtctl.loop import generate, safety
from rtctl.loop.records import layout

CONFIGS = Path(__file__).parents[2] / "configs"


@dataclass(frozen=True, eq=False)
class Run:
    """Rows of a run, and the loop as it stands at its end."""

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


def config(name: str, reference: str | None = None, **changes: Any) -> Any:
    """A shipped config in fused mode; `changes` are keys with __ for dots."""
    sets = [f"{key.replace('__', '.')}={json.dumps(value)}" for key, value in changes.items()]
    loaded = common.load_config(str(CONFIGS / f"{name}.yaml"), sets)
    path = None if reference is None else str(CONFIGS / "references" / f"{reference}.yaml")
    return common.with_loop(common.with_reference(loaded, path), "fused", None)


def run(config: Any, seconds: float) -> Run:
    """Arm and play from the first tick on."""
    machine = machines.build(config)
    made = generate.generate(machine, "shm")
    ticks = round(seconds * machine.rate)
    segment: Any = {
        name: np.zeros(count, dtype)
        for name, (dtype, count) in layout(made.params, made.tables, made.row, ticks).items()
    }
    loop = Loop(machine, made, segment, segment["outputs"], segment["inputs"])
    generate.fill_tables(segment["tables"][0], (machine.reference, machine.excitation))
    loop.c["arm"] = loop.c["play"] = 1
    loop.stretch(0, ticks)
    return Run(segment["rows"], loop)


@lru_cache(maxsize=64)
def shipped(name: str, reference: str, seconds: float, **changes: Any) -> Run:
    """A shipped config with a shipped reference, run once for all tests that look at it."""
    return run(config(name, reference, **changes), seconds)
