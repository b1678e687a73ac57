"""The emulated side of the Linear Drive Unit: amplifier, mechanics, encoder and scale, as the board sees them."""

from typing import TYPE_CHECKING

import numpy as np

from rtctl.drivers import at_mio_16de, daq_stc, ldu_amplifier, linear_scale, ls7084
from rtctl.machines.base import Block, Column, PlantDiagram, physics_lines
from rtctl.plants import ldu as plant_ldu

if TYPE_CHECKING:
    from rtctl.machines.ldu import LduConfig

TRUTH = (
    Column("truth_x", "m", "carriage position in the emulator, with slip, capstan and guide"),
    Column("truth_speed", "m/s", "capstan speed times R_c in the emulator"),
    Column("truth_current", "A", "motor current in the emulator"),
)


def substeps(config: "LduConfig", period: float) -> int:
    """Integration steps of the emulator in `period` s."""
    return max(1, int(np.ceil(period / config.plant.substep - 1e-9)))


def plant_diagram(config: "LduConfig", period: float, seed: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by `period` s a call."""
    h = period / substeps(config, period)
    terms = physics_lines(config.plant.physics, "ldu", h)
    output = at_mio_16de.build_output(config.board.output, h)
    blocks = (
        Block(
            "plant",
            plant_ldu.build(config.plant, h, (2 * np.pi * config.plant.bandwidth, config.plant.damping)),
            plant_ldu.LDU_STATE,
        ),
        Block("amplifier", ldu_amplifier.build(config.plant.amplifier, h, output.volts_per_code), None),
        Block("output", output, at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("encoder", ls7084.build(config.sensors.encoder, h), ls7084.LS7084_STATE),
        Block("counter0", None, daq_stc.COUNTER_STATE),
        Block("scale", linear_scale.build(config.sensors.scale, h), linear_scale.LINEAR_SCALE_STATE),
        Block("counter1", None, daq_stc.COUNTER_STATE),
        *terms.blocks,
    )
    line = config.board.direction_line
    advance = (
        (
            "amplifier",
            (
                "volts = at_mio_16de.output_step(p.output, s.output, tx.ao_codes[0], p.plant.h)",
                f"forward = (tx.dio_lines >> {line}) & 1",
                "s.plant.m.volts[0] = volts if forward != 0 else -volts",
                *terms.command,
                "s.plant.m.u[0] = ldu_amplifier.drive(p.amplifier, s.plant.m.volts[0], forward)",
            ),
        ),
        ("physics", ("linear.midpoint(s.plant.m)", *terms.force, "linear.advance(s.plant.m)")),
        (
            "encoder and scale",
            (
                "plant.read(p.plant.graph, s.plant.m)",
                *terms.reading,
                "pulses = ls7084.step(p.encoder, s.encoder, s.plant.m.y[0], p.plant.h)",
                "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
                "pulses = linear_scale.step(p.scale, s.scale, s.plant.m.y[1])",
                "daq_stc.counter_step(s.counter1, abs(pulses), pulses > 0)",
            ),
        ),
    )
    sample = (
        (
            "scan",
            (
                "rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",
                "rx.counter_codes[1] = daq_stc.counter_step(s.counter1, 0, 1)",
                "rx.lost_counts = s.encoder.lost",
            ),
        ),
        (
            "truth",
            (
                *(("plant.read(p.plant.graph, s.plant.m)",) if terms.reading else ()),  # without errors of the sensors
                *terms.moves,
                "rx.truth[0] = s.plant.m.y[1]",
                "rx.truth[1] = p.plant.R_c * s.plant.m.x[ldu.NQ + ldu.CAPSTAN]",
                "rx.truth[2] = s.plant.m.x[2 * ldu.NQ]",
            ),
        ),
    )
    return PlantDiagram(
        uses=(
            "rtctl.drivers.at_mio_16de",
            "rtctl.drivers.daq_stc",
            "rtctl.drivers.ldu_amplifier",
            "rtctl.drivers.linear_scale",
            "rtctl.drivers.ls7084",
            "rtctl.plants.graph.plant",
            "rtctl.plants.ldu",
            "rtctl.plants.linear",
            *terms.uses,
        ),
        blocks=blocks,
        truth=TRUTH,
        start=("plant.start(p.plant.graph, s.plant)",),
        advance=advance,
        sample=sample,
    )
