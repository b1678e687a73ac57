"""Emulated machine of a description: one compiled kernel for all machines, with arrays as params, and its board.

Only the lines below are generated: a converter for each drive, a counter or a number for each sensor.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from rtctl.drivers import at_mio_16de, daq_stc, linear_scale, readout
from rtctl.drivers.at_mio_16de import AnalogOutputParams
from rtctl.drivers.linear_scale import LinearScaleParams
from rtctl.idiom import tick
from rtctl.machines.base import Block, Column, PlantDiagram, physics_lines
from rtctl.plants.graph import layout as graph_layout
from rtctl.plants.graph import params as graph_params
from rtctl.plants.graph import plant
from rtctl.plants.graph.coupled import machine_params
from rtctl.plants.graph.description import Description, Sensor
from rtctl.plants.graph.elements import place_of
from rtctl.plants.graph.joints import sprung
from rtctl.plants.graph.mechanics import code_of
from rtctl.plants.graph.units import WAY
from rtctl.plants.linear import MOST_BODIES
from rtctl.plants.physics import TERMS

BITS = 16  # of a drive's converter, if unknown
FINE = 1e-6  # column units, resolution of a number, if unknown
WRITE, SETTLING = at_mio_16de.WRITE, at_mio_16de.SETTLING


class TruthParams(NamedTuple):
    n: int
    i: np.ndarray  # (MOST_BODIES,) coordinate of each body
    a: np.ndarray  # (MOST_BODIES,) motion of the body for one unit of its coordinate


def is_counter(sensor: Sensor) -> bool:
    """Whether a sensor's column holds counts of a position, which a counter adds up."""
    return sensor.counts_per_unit is not None and sensor.measures == "position"


def converter(config: Any, number: int) -> AnalogOutputParams:
    """Converter of a drive; 16 bits over the range of its commands where the description has none."""
    drive = list(config.machine.drives.values())[number]
    bits = drive.dac_bits or BITS
    full = drive.dac_range if drive.dac_bits else max(drive.limit or 0.0, config.law.limit.high)
    half = 1 << (bits - 1)
    return AnalogOutputParams(full / half, -half, half - 1, number, (number + 1) * WRITE, SETTLING)


def readout_of(sensor: Sensor, seed: int) -> readout.ReadoutParams:
    """Resolution and noise of a sensor that gives a number."""
    noise = sensor.noise or 0.0
    return readout.build(sensor.scale, sensor.grain or (noise / 8 if noise else FINE), noise, seed)


def wires(machine: Description) -> dict[str, str]:
    """Code of each sensor in the link's frame: counters first, then numbers, both in the order of the description."""
    found: dict[str, str] = {}
    counters = numbers = 0
    for name, sensor in machine.sensors.items():
        if is_counter(sensor):
            found[name], counters = f"rx.counter_codes[{counters}]", counters + 1
        else:
            found[name], numbers = f"rx.ai_codes[{numbers}]", numbers + 1
    return found


def truth_columns(machine: Description) -> tuple[Column, ...]:
    """Columns of the true position and speed of every moving body."""
    columns: list[Column] = []
    for name, body in machine.bodies.items():
        if not machine.is_frame(name):
            way, word = WAY[body.turns], name.replace("-", "_")
            columns += (
                Column(f"truth_{word}", way, f"position of {name} in the emulator"),
                Column(f"truth_{word}_speed", f"{way}/s", f"speed of {name} in the emulator"),
            )
    return tuple(columns)


def truth_params(layout: graph_layout.Layout, values: dict[str, float]) -> TruthParams:
    """Coordinates and ratios of the bodies of `truth_columns`."""
    i, a = np.zeros(MOST_BODIES, np.int64), np.zeros(MOST_BODIES)
    moving = [name for name in layout.machine.bodies if not layout.machine.is_frame(name)]
    for n, name in enumerate(moving):
        i[n], a[n] = layout.coordinate(name), layout.ratio(name, values)
    return TruthParams(len(moving), i, a)


@tick
def tell(p, m, truth):
    """Write position and speed of each body into `truth`, one after the other."""
    for n in range(p.n):
        truth[2 * n] = p.a[n] * m.x[p.i[n]]
        truth[2 * n + 1] = p.a[n] * m.x[m.nq + p.i[n]]


def graph_of(machine: Description, h: float) -> tuple[graph_layout.Layout, dict[str, float], graph_params.GraphParams]:
    """Layout, values and params of a description for substeps of `h` s."""
    layout = graph_layout.layout(machine)
    values = dict(machine.paths())
    return layout, values, machine_params(layout, values, h)


def plant_diagram(config: Any, h: float, seed: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by substeps of `h` s."""
    machine, _ = sprung(config.machine, config.plant.physics)
    layout, values, params = graph_of(machine, h)
    code = code_of(machine)
    steps = code.steps.__name__ if code is not None else "linear"
    start: tuple[str, ...] = ("plant.start(p.plant, s.plant)",)
    shown: tuple[str, ...] = ()
    given = ""
    if code is not None:
        start, given = (*start, f"{steps}.place(p.plant, s.plant.m)"), "p.plant, "
        shown = (f"{steps}.zero(p.plant, s.plant.m)",)
    acting = [entry for entry in config.plant.physics if TERMS[entry.term].act]
    terms = physics_lines(acting, config.kind, h, lambda entry: place_of(layout, values, entry))
    outputs = [
        Block(f"output{n}", converter(config, n), at_mio_16de.ANALOG_OUTPUT_STATE) for n in range(len(machine.drives))
    ]
    sensors = list(_sensors(machine, seed))
    blocks = (
        Block("plant", params, plant.GRAPH_STATE),
        Block("truth", truth_params(layout, values), None),
        *outputs,
        *(block for _, blocks, _ in sensors for block in blocks),
        *terms.blocks,
    )
    advance = (
        (
            "drives",
            (
                *(
                    f"s.plant.m.volts[{n}] = at_mio_16de.output_step("
                    f"p.{block.name}, s.{block.name}, tx.ao_codes[{n}], p.plant.h)"
                    for n, block in enumerate(outputs)
                ),
                "plant.ask(p.plant, s.plant.m)",
                *terms.command,
                "plant.take(p.plant, s.plant.m)",
            ),
        ),
        (
            "physics",
            (
                "linear.midpoint(s.plant.m)",
                "plant.weigh(p.plant, s.plant.m)",
                *terms.force,
                f"{steps}.advance({given}s.plant.m)",
            ),
        ),
    )
    sample = (
        ("sensors", ("plant.read(p.plant, s.plant.m)", *shown, *terms.reading)),
        ("scan", tuple(line for _, _, lines in sensors for line in lines)),
        ("truth", ("described_plant.tell(p.truth, s.plant.m, rx.truth)",)),
    )
    return PlantDiagram(
        uses=(
            "rtctl.drivers.at_mio_16de",
            "rtctl.drivers.daq_stc",
            "rtctl.drivers.linear_scale",
            "rtctl.drivers.readout",
            "rtctl.machines.described_plant",
            "rtctl.plants.graph.plant",
            "rtctl.plants.linear",
            *((steps,) if code is not None else ()),
            *terms.uses,
        ),
        blocks=blocks,
        truth=truth_columns(machine),
        start=start,
        advance=advance,
        sample=sample,
    )


def _sensors(machine: Description, seed: int) -> Iterable[tuple[str, tuple[Block, ...], tuple[str, ...]]]:
    """Name, blocks and lines of each sensor."""
    wire = wires(machine)
    for n, (name, sensor) in enumerate(machine.sensors.items()):
        if is_counter(sensor):
            scale = LinearScaleParams(sensor.scale, 1.0 / sensor.scale)
            yield (
                name,
                (
                    Block(f"sensor{n}", scale, linear_scale.LINEAR_SCALE_STATE),
                    Block(f"counter{n}", None, daq_stc.COUNTER_STATE),
                ),
                (
                    f"pulses = linear_scale.step(p.sensor{n}, s.sensor{n}, s.plant.m.y[{n}])",
                    f"{wire[name]} = daq_stc.counter_step(s.counter{n}, abs(pulses), pulses > 0)",
                ),
            )
        else:
            yield (
                name,
                (Block(f"sensor{n}", readout_of(sensor, seed * 64 + n), readout.READOUT_STATE),),
                (f"{wire[name]} = readout.codes(p.sensor{n}, s.sensor{n}, s.plant.m.y[{n}])",),
            )
