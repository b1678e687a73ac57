"""Board channels of each machine, and the names of its drives and sensors there.

The order is that of the codes in the link's frame, for an emulated board, a real board and an FMU alike.
"""

import math
from typing import Any

from rtctl.drivers import readout
from rtctl.drivers.at_mio_16de import AnalogInputParams
from rtctl.drivers.board import Quantity, Wiring
from rtctl.machines.base import DESCRIBED
from rtctl.machines.described_plant import converter, is_counter, readout_of
from rtctl.machines.profile import Terminals
from rtctl.machines.profiles import PROFILES, profile_of
from rtctl.plants.graph.description import Description, Sensor

TERMINALS: dict[str, Terminals] = {kind: profile.terminals for kind, profile in PROFILES.items()}


def wiring(config: Any) -> Wiring:
    """Channels that a machine's config uses, with the names of its drives and sensors."""
    if config.kind == DESCRIBED:
        return described(config)
    profile = profile_of(config.kind)
    assert profile.wiring is not None  # only described machines lack it
    wires: Wiring = profile.wiring(config)
    names = TERMINALS[config.kind]
    seen = [sensor.name for sensor in names.sensors]
    turns = (None,) * len(seen)
    measures = ("position",) * wires.counters + ("voltage",) * (len(seen) - wires.counters)
    return wires._replace(
        drives=tuple(d.name for d in names.drives), sensors=tuple(seen), measures=measures, turns=turns
    )


def described(config: Any) -> Wiring:
    """Commands and sensors of a description: counters, then numbers, as `described_plant.wires` has them."""
    machine = config.machine
    outputs = [
        Quantity(name, drive.unit, converter(config, n)) for n, (name, drive) in enumerate(machine.drives.items())
    ]
    counters = {name: s for name, s in machine.sensors.items() if is_counter(s)}
    numbers = {name: s for name, s in machine.sensors.items() if not is_counter(s)}
    inputs = [Quantity(name, "", _number(sensor)) for name, sensor in numbers.items()]
    seen = {**counters, **numbers}
    return Wiring(
        tuple(outputs), tuple(inputs), len(counters),
        drives=tuple(machine.drives), sensors=tuple(seen), measures=tuple(s.measures for s in seen.values()),
        turns=tuple(_turn(machine, s) for s in seen.values()),
    )  # fmt: skip


def _number(sensor: Sensor) -> AnalogInputParams:
    """Code of a sensor that gives a number, for a value in SI."""
    p = readout_of(sensor, 0)
    most = int(readout.LARGEST)
    return AnalogInputParams(p.grain / p.scale, -most, most, 0, 0.0, 0)


def _turn(machine: Description, sensor: Sensor) -> float | None:
    """Counts, or rad, of a sensor for one turn of its body; None for a sliding body or a sensor without a body."""
    if sensor.body is None or not machine.turns(sensor.body):
        return None
    return 2.0 * math.pi * (sensor.counts_per_unit or 1.0) if is_counter(sensor) else 2.0 * math.pi
