"""Execution of one run of a campaign, and of a chunk of runs, in this process or in a worker.

Generation of a machine's tick takes longer than its run. Therefore the generated module is cached for each structure,
and differences between runs (gains, radii, references, seeds, faults) go into records.
"""

import threading
from typing import Any

import numpy as np

from rtctl import machines
from rtctl.campaign.metrics import measure
from rtctl.campaign.plan import Plan
from rtctl.config.errors import NoAnswer, UserError
from rtctl.loop import fused, generate
from rtctl.loop.fused import Run
from rtctl.machines import Machine
from rtctl.own.files import trust
from rtctl.tick import safety

_made: dict[Any, generate.Generated] = {}
_plans: dict[str, Plan] = {}
_lock = threading.Lock()  # a Dask worker may have several threads


def run_chunk(payload: dict[str, Any], identity: str, chunk: int) -> list[dict[str, Any]]:
    """Result rows of one chunk."""
    with _lock:
        for base in payload["bases"].values():
            trust(base.get("own", {}).values())  # trusted: sent by the process that read the campaign file
        plan = _plans.get(identity) or _plans.setdefault(identity, Plan(payload))
    return [run_row(plan, number) for number in plan.numbers(chunk)]


def run_row(plan: Plan, number: int) -> dict[str, Any]:
    """Result row of one run. The row reports an invalid setting; none is raised."""
    row: dict[str, Any] = {"run": number, **plan.labels(number)}
    try:
        run = play(plan, number)
    except (UserError, NoAnswer, ValueError, ArithmeticError, MemoryError) as error:
        text = str(error) or type(error).__name__
        return {**row, **dict.fromkeys(plan.metrics), "trip": "", "error": text}
    found = measure(run, run.loop.machine, plan.metrics)
    values = {name: value if np.isfinite(value) else None for name, value in found.items()}
    return {**row, **values, "trip": run.tripped, "error": _trouble(run)}


def _trouble(run: Run) -> str:
    """Reason why a run has no result, "" where it has one."""
    if run.tripped or (run.rows["state"] == safety.RUNNING).any():
        return ""
    return f"was not running within {len(run.rows) / run.loop.machine.rate:g} s; give it more `seconds`"


def play(plan: Plan, number: int) -> Run:
    """Finished run `number`. Raises UserError and ValueError for invalid settings."""
    machine = machines.build(plan.config(number))
    return fused.play(machine, structure(machine), plan.ticks(machine))


def structure(machine: Machine) -> generate.Generated:
    """Generated module of a machine, shared by machines that differ only in numbers."""
    loop, plant = machine.diagram, machine.plant_diagram
    key = (
        machine.kind, machine.substeps, machine.truth, tuple(machine.config.record.trace),
        loop.uses, loop.columns, loop.stages, plant.uses, plant.truth, plant.start, plant.advance, plant.sample,
        *(_records(blocks) for blocks in (loop.blocks, plant.blocks)),
        *(value.shape for value in machine.excitation if isinstance(value, np.ndarray)),
    )  # fmt: skip
    with _lock:
        if key not in _made:
            _made[key] = generate.generate(machine, "shm")
        return _made[key]


def _records(blocks: Any) -> tuple:
    """Names, kinds and sizes of a diagram's records."""
    return tuple((b.name, b.state, _fields(b.params)) for b in blocks)


def _fields(value: Any) -> Any:
    if hasattr(value, "_fields"):
        return (type(value), *map(_fields, value))
    if isinstance(value, np.ndarray):
        return (value.dtype, value.shape)
    return isinstance(value, (bool, int, np.integer))


def clear() -> None:
    """Clear the caches of modules and plans."""
    with _lock:
        _made.clear()
        _plans.clear()
