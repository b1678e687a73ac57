"""Closed loop of our own recordings: the machine of their config with a model as its plant, on virtual time.

The loop is the generated tick of that config, told at each tick what the recording's journal says it was told. So the
law is what it was, to the bit, an own file's too, where the user gives that file by path; code that came with the
recording is never run.
"""

from typing import Any

import numpy as np
from pydantic import ValidationError

from rtctl import machines
from rtctl.config.complaints import sentences
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_paths
from rtctl.diagnose.case import PARAMETERS
from rtctl.diagnose.columns import measured_amplifier, through_amplifier
from rtctl.diagnose.model import Model
from rtctl.diagnose.record import Record
from rtctl.loop import fused, generate
from rtctl.loop.loop import Loop
from rtctl.machines import Machine
from rtctl.own.files import OwnError
from rtctl.trace.bundle import Bundle
from rtctl.trace.orders import Order, orders, restore

NEEDED = ("tick", "order", "link_age")  # columns of every recording of our own


def can_emulate(bundle: Bundle) -> bool:
    """Whether a bundle is a recording of our own, complete from its first tick on."""
    columns = bundle.columns
    if not isinstance(bundle.case.get("config"), dict) or any(name not in columns for name in NEEDED):
        return False
    ticks = columns["tick"]
    return bool(ticks[0] == 0 and (np.diff(ticks) == 1).all())


def emulate(bundle: Bundle, record: Record, model: Model) -> dict[str, np.ndarray]:
    """Readings and commands (n,) by the names of their columns, at the rows of `record`, the loop closed by the config.

    Readings are as `record.y` has them, commands in the unit of `record.u`. Raises UserError where the config cannot
    be built, as where an own file was not given, and NoAnswer where the emulated machine trips.
    """
    machine = _machine(bundle, model)
    told = orders(bundle.folder)
    made = generate.generate(machine, "shm")
    arrays = fused.segment(made, len(bundle.columns["t"]))
    generate.prepare(arrays, machine)
    generate.fill_tables(arrays["tables"][1], (machine.reference, machine.excitation))
    loop = Loop(machine, made, arrays, arrays["outputs"], arrays["inputs"])
    at, number = 0, bundle.columns["order"]
    for end in (*np.flatnonzero(np.diff(number)) + 1, len(number)):
        _obey(loop, bundle, model, told, int(number[at]))
        loop.stretch(at, int(end) - at)
        at = int(end)
    rows = arrays["rows"]
    tripped = np.flatnonzero((rows["trip"] != 0) & (bundle.columns["trip"] == 0))
    if len(tripped):
        k = int(tripped[0])
        raise NoAnswer(f"the model trips the machine at tick {k} ({bundle.columns['t'][k]:.6g} s) in closed loop")
    return _columns(rows[record.columns["tick"].astype(np.int64)], bundle, record)


def _columns(rows: np.ndarray, bundle: Bundle, record: Record) -> dict[str, np.ndarray]:
    """The rows' readings with the shift that the record gives its own, and the commands."""
    found = {name: rows[name] + (values[0] - record.columns[name][0]) for name, values in record.y.items()}
    for name in record.commands:
        bent = record.plant == "ldu" and measured_amplifier(bundle.case["config"])
        found[name] = through_amplifier(rows[name]) if bent else rows[name]
    return found


def _machine(bundle: Bundle, model: Model, changed: dict[str, Any] | None = None) -> Machine:
    """The machine of the bundle's config, in fused mode, with the model as its plant."""
    config = dict(bundle.case["config"])
    base = dict(model.base)
    if model.kind == "ldu" and "N" in base:
        base["R_s"] = base["R_t"] / base["N"]  # the gear ratio is what the equations use
    plant = dict(config.get("plant") or {})
    plant["parameters"] = {name: base[name] for name in PARAMETERS[model.kind].model_fields if name in base}
    plant["physics"] = [term.model_dump(mode="json") for term in model.terms]
    plant.pop("fmu", None)
    loop = {**(config.get("loop") or {}), "mode": "fused"}
    data: Any = {**config, "plant": plant, "loop": loop, "driver": {"kind": "emulated"}}
    kind = machines.CONFIGS[model.kind]
    try:
        kind, data = machines.widened(data)
        settings = kind.model_validate(data)
        return machines.build(set_paths(settings, changed or {}))
    except ValidationError as error:
        raise UserError(f"{bundle.folder}/case.json, config: {sentences(error, kind, data)}") from None
    except (OwnError, ValueError) as error:
        raise UserError(f"{bundle.folder}/case.json, config: {error}") from None


def _obey(loop: Loop, bundle: Bundle, model: Model, told: dict[int, Order], number: int) -> None:
    """Give the loop an order of the journal, and the settings changed by then."""
    if not number:
        return
    if number not in told:
        raise NoAnswer(f"order {number} is not in the journal: the loop cannot be closed as the recording's was")
    changed = {path: value for n in range(1, number + 1) if n in told for path, value in told[n].changed.items()}
    if changed:
        generate.fill(loop.p[0], _machine(bundle, model, changed).diagram.blocks)
    restore(loop.c[0], told[number].command)
