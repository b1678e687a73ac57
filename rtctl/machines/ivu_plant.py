"""The emulated side of the Image Verification Unit: drivers, mechanics and sensors, as the board sees them."""

import numpy as np

from rtctl.drivers import at_mio_16de, daq_stc, l292, ls7084, optical_sensor
from rtctl.machines.base import Block, Column, PlantDiagram, physics_lines
from rtctl.machines.ivu_settings import IvuConfig
from rtctl.plants import ivu as plant_ivu

RIPPLE = (  # 22 kHz, averaged over each substep; the remainder aliases, as on the machine
    "s.plant.m.f[ivu.MOTOR1] += p.plant.K_m1 * l292.ripple_step(p.driver, s.ripple1, p.plant.h)",
    "s.plant.m.f[ivu.MOTOR2] += p.plant.K_m2 * l292.ripple_step(p.driver, s.ripple2, p.plant.h)",
)
TRUTH = (
    Column("truth_tension1", "N", "tape tension at reel 1 in the emulator"),
    Column("truth_tension2", "N", "tape tension at reel 2 in the emulator"),
    Column("truth_capstan", "rad", "capstan angle in the emulator"),
    Column("truth_motor1", "rad", "angle of motor 1 in the emulator"),
    Column("truth_motor2", "rad", "angle of motor 2 in the emulator"),
    Column("truth_R1", "m", "radius of reel 1 in the emulator"),
    Column("truth_R2", "m", "radius of reel 2 in the emulator"),
)


def substeps(config: IvuConfig, period: float) -> int:
    """Integration steps of the emulator in `period` s."""
    return max(1, int(np.ceil(period / config.plant.substep - 1e-9)))


def plant_diagram(config: IvuConfig, period: float, seed: int) -> PlantDiagram:
    """Blocks and lines of the emulated machine, advanced by `period` s a call."""
    h = period / substeps(config, period)
    board = config.board
    driver = (*l292.second_order(config.plant.driver), config.plant.driver.R_F * config.plant.driver.C_F)
    terms = physics_lines(config.plant.physics, "ivu", h)
    follow = ("plant.weigh(p.plant.graph, s.plant.m)",) if config.plant.follow_tape else ()
    ripple = RIPPLE if config.plant.driver.ripple else ()
    params = plant_ivu.build(config.plant, h, [driver, driver], config.plant.follow_tape)
    blocks = (
        Block("plant", params, plant_ivu.IVU_STATE),
        Block("driver", l292.build(config.plant.driver, h), None),
        Block("output1", at_mio_16de.build_output(config.board.output1, h), at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("output2", at_mio_16de.build_output(config.board.output2, h), at_mio_16de.ANALOG_OUTPUT_STATE),
        Block("capstan", ls7084.build(config.sensors.capstan, h), ls7084.LS7084_STATE),
        Block("counter0", None, daq_stc.COUNTER_STATE),
        Block("reel1", optical_sensor.build(config.sensors.reel1, h), None),
        Block("reel2", optical_sensor.build(config.sensors.reel2, h), None),
        *(
            Block(name, at_mio_16de.build_input(wire, h, board.dither, i, seed), at_mio_16de.ANALOG_INPUT_STATE)
            for i, (name, wire) in enumerate((("input1", board.reel1), ("input2", board.reel2)))
        ),
        *(Block(name, None, l292.RIPPLE_STATE) for name in ("ripple1", "ripple2") if ripple),
        *terms.blocks,
    )  # fmt: skip
    advance = (
        (
            "drivers",
            (
                "u1 = at_mio_16de.output_step(p.output1, s.output1, tx.ao_codes[0], p.plant.h)",
                "u2 = at_mio_16de.output_step(p.output2, s.output2, tx.ao_codes[1], p.plant.h)",
                "s.plant.m.volts[0] = u1",
                "s.plant.m.volts[1] = u2",
                *terms.command,
                "s.plant.m.u[0] = l292.limit(p.driver, s.plant.m.volts[0])",
                "s.plant.m.u[1] = l292.limit(p.driver, s.plant.m.volts[1])",
            ),
        ),
        ("physics", ("linear.midpoint(s.plant.m)", *follow, *ripple, *terms.force, "linear.advance(s.plant.m)")),
        (
            "encoder",
            (
                "plant.read(p.plant.graph, s.plant.m)",
                *terms.reading,
                "pulses = ls7084.step(p.capstan, s.capstan, s.plant.m.y[0], p.plant.h)",
                "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
            ),
        ),
    )
    sample = (
        (
            "scan",
            (
                "rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",
                "theta1 = s.plant.m.y[1] + s.plant.m.x[ivu.NQ + ivu.REEL1] * p.input1.scan_delay",
                "theta2 = s.plant.m.y[2] + s.plant.m.x[ivu.NQ + ivu.REEL2] * p.input2.scan_delay",
                "rx.ai_codes[0] = at_mio_16de.input_step(p.input1, s.input1, optical_sensor.volts(p.reel1, theta1))",
                "rx.ai_codes[1] = at_mio_16de.input_step(p.input2, s.input2, optical_sensor.volts(p.reel2, theta2))",
                "rx.lost_counts = s.capstan.lost",
            ),
        ),
        (
            "truth",
            (
                "rx.truth[0] = linear.tension(s.plant.m, 0)",  # at the middle of the last substep
                "rx.truth[1] = linear.tension(s.plant.m, 1)",
                "rx.truth[2] = s.plant.m.x[ivu.CAPSTAN]",
                "rx.truth[3] = s.plant.m.x[ivu.MOTOR1]",
                "rx.truth[4] = s.plant.m.x[ivu.MOTOR2]",
                "rx.truth[5] = s.plant.m.reel_R[0]",
                "rx.truth[6] = s.plant.m.reel_R[1]",
            ),
        ),
    )
    return PlantDiagram(
        uses=(
            "rtctl.drivers.at_mio_16de",
            "rtctl.drivers.daq_stc",
            "rtctl.drivers.l292",
            "rtctl.drivers.ls7084",
            "rtctl.drivers.optical_sensor",
            "rtctl.plants.graph.plant",
            "rtctl.plants.ivu",
            "rtctl.plants.linear",
            *terms.uses,
        ),
        blocks=blocks,
        truth=TRUTH,
        start=("plant.start(p.plant.graph, s.plant)",),
        advance=advance,
        sample=sample,
    )
