"""Emulation of a recording by rtctl in closed loop: the machine of its config with a model as plant, on virtual time.

The loop is the generated tick of the config, with the orders from the journal of the recording. The law is equal to the
recorded one to the bit, also a law of a user file that is given by path; code that came with the recording is never
run.
"""

from typing import Any

import numpy as np
from pydantic import ValidationError

from rtctl import machines
from rtctl.case.unsaid import measured_amplifier
from rtctl.config.complaints import sentences
from rtctl.config.errors import NoAnswer, UserError
from rtctl.config.load import set_paths
from rtctl.diagnose.answer.format1_config import plant_section
from rtctl.diagnose.model.format1 import known_model
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.record.columns import through_amplifier
from rtctl.diagnose.record.replayed import by_rtctl
from rtctl.loop import fused, generate
from rtctl.loop.loop import Loop
from rtctl.machines import Machine
from rtctl.own.files import OwnError
from rtctl.trace.bundle import Bundle
from rtctl.trace.orders import Order, orders, restore


def can_emulate(bundle: Bundle) -> bool:
    """Whether a bundle is a recording by rtctl, complete from its first tick on."""
    if not by_rtctl(bundle):
        return False
    ticks = bundle.columns["tick"]
    return bool(ticks[0] == 0 and (np.diff(ticks) == 1).all())


def emulate(bundle: Bundle, record: GraphRecord) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Readings (n,) by sensor, SI, and commands (n, drives) at the rows of `record`, the loop closed by the config
    around the nominal model of the record's case.

    Raises UserError where the config cannot be built, for example without a user file, and NoAnswer where the
    emulated machine trips.
    """
    config = config_of(bundle, record)
    machine = _machine(bundle, config)
    told = orders(bundle.folder)
    made = generate.generate(machine, "shm")
    arrays = fused.segment(made, len(bundle.columns["t"]))
    generate.prepare(arrays, machine)
    generate.fill_tables(arrays["tables"][1], (machine.reference, machine.excitation))
    loop = Loop(machine, made, arrays, arrays["outputs"], arrays["inputs"])
    at, number = 0, bundle.columns["order"]
    for end in (*np.flatnonzero(np.diff(number)) + 1, len(number)):
        _obey(loop, bundle, config, told, int(number[at]))
        loop.stretch(at, int(end) - at)
        at = int(end)
    rows = arrays["rows"]
    tripped = np.flatnonzero((rows["trip"] != 0) & (bundle.columns["trip"] == 0))
    if len(tripped):
        k = int(tripped[0])
        raise NoAnswer(f"the model trips the machine at tick {k} ({bundle.columns['t'][k]:.6g} s) in closed loop")
    return _columns(rows, bundle, record)


def config_of(bundle: Bundle, record: GraphRecord) -> dict[str, Any]:
    """Config of the bundle as plain data, in fused mode, with the nominal model of the record's case as its plant."""
    config, case = dict(bundle.case["config"]), record.case
    plant = {key: value for key, value in dict(config.get("plant") or {}).items() if key != "fmu"}
    if record.source is not None:
        plant |= plant_section(known_model(nominal(case), record))
    else:
        config["machine"] = case.machine.model_dump(mode="json", exclude_unset=True)
        plant["physics"] = list(case.physics)
    loop = {**(config.get("loop") or {}), "mode": "fused"}
    return {**config, "plant": plant, "loop": loop, "driver": {"kind": "emulated"}}


def _columns(rows: np.ndarray, bundle: Bundle, record: GraphRecord) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Readings (n,) by sensor, SI: the recorded ones plus the difference of the emulated from the recorded columns; and
    commands (n, drives)."""
    source, machine = record.source, record.case.machine
    columns = bundle.columns if source is None else source.columns
    ticks = columns["tick"].astype(np.int64)
    readings = {}
    for name, seen in {**record.y, **record.edges}.items():
        sensor = machine.sensors[name]
        scale = 1.0 if name in record.y else sensor.scale
        readings[name] = seen / scale + (rows[sensor.column][ticks] - columns[sensor.column]) / sensor.scale
    bent = measured_amplifier(bundle.case["config"])
    commands = [rows[drive.column][ticks] for drive in machine.drives.values()]
    volts = np.column_stack([through_amplifier(u) if bent else u for u in commands])
    return readings, volts


def _machine(bundle: Bundle, config: dict[str, Any], changed: dict[str, Any] | None = None) -> Machine:
    """Machine of a config with other values by dotted path."""
    kind: Any = None
    try:
        kind, data = machines.widened(config)
        settings = kind.model_validate(data)
        return machines.build(set_paths(settings, changed or {}))
    except ValidationError as error:
        raise UserError(f"{bundle.folder}/case.json, config: {sentences(error, kind, data)}") from None
    except (OwnError, ValueError) as error:
        raise UserError(f"{bundle.folder}/case.json, config: {error}") from None


def _obey(loop: Loop, bundle: Bundle, config: dict[str, Any], told: dict[int, Order], number: int) -> None:
    """Give the loop an order of the journal, and the settings changed by then."""
    if not number:
        return
    if number not in told:
        raise NoAnswer(f"order {number} is not in the journal: the closed loop of the recording cannot be repeated")
    changed = {path: value for n in range(1, number + 1) if n in told for path, value in told[n].changed.items()}
    if changed:
        generate.fill(loop.p[0], _machine(bundle, config, changed).diagram.blocks)
    restore(loop.c[0], told[number].command)
