"""Profile of the Linear Drive Unit: a current amplifier, a capstan with an encoder, a carriage with a scale."""

from typing import Any

import numpy as np

from rtctl.drivers import at_mio_16de, daq_stc, ldu_amplifier, linear_scale, ls7084
from rtctl.drivers.board import Wiring
from rtctl.machines import ldu, ldu_plant
from rtctl.machines.base import Block
from rtctl.machines.ldu_duty import DUTY
from rtctl.machines.ldu_exchange import EXCHANGE
from rtctl.machines.ldu_motion import model
from rtctl.machines.profile import (
    AMPLIFIER,
    SCALE,
    Columns,
    Friction,
    OwnBlocks,
    Profile,
    Range,
    Response,
    Terminal,
    Terminals,
    Usual,
)
from rtctl.machines.told import given, position
from rtctl.plants import ldu as plant


def drive(config: Any, f: np.ndarray) -> np.ndarray:
    """Response (n,) of the amplifier in A/V at `f` (n,) Hz."""
    s, w = 2j * np.pi * f, 2 * np.pi * config.plant.bandwidth
    return ldu_amplifier.AMPERE_PER_VOLT / (1 + 2 * config.plant.damping * s / w + (s / w) ** 2)


def params(settings: Any, R1: float, R2: float) -> Any:
    """Params of the plant; R1 and R2 are not used, since there are no reels."""
    return plant.build(settings, 1e-3, (2 * np.pi * settings.bandwidth, settings.damping))


def counts(config: Any) -> float:
    """Counts of the encoder for a metre of the carriage."""
    encoder = config.sensors.encoder
    return float(encoder.lines * encoder.multiply / (2 * np.pi)) / float(plant.parameters(config.plant).R_c)


def case(config: Any) -> dict[str, Any]:
    """Keys of case.json: the nominal model of the config."""
    parameters = plant.parameters(config.plant)
    return {
        "parameters": {**given(parameters), "N": parameters.R_t / parameters.R_s},
        "sensors": {
            "encoder_counts_per_rev": config.sensors.encoder.lines * config.sensors.encoder.multiply,
            "scale_m_per_count": config.sensors.scale.pitch,
        },
        "drive": {
            "amp_per_volt": [0.1],
            "limit_volt": config.law.limit.high,
            "dac_bits": 12,
            "dac_range_volt": 10.0,
            "bandwidth_hz": config.plant.bandwidth,
            "damping": config.plant.damping,
        },
        "controller": position(config.law),
    }


def own(config: Any, h: float, seed: int) -> OwnBlocks:
    """Amplifier, converter, encoder and scale around a user's plant."""
    output = at_mio_16de.build_output(config.board.output, h)
    return OwnBlocks(
        (
            Block("amplifier", ldu_amplifier.build(config.amplifier, h, output.volts_per_code), None),
            Block("output", output, at_mio_16de.ANALOG_OUTPUT_STATE),
            Block("encoder", ls7084.build(config.sensors.encoder, h), ls7084.LS7084_STATE),
            Block("counter0", None, daq_stc.COUNTER_STATE),
            Block("scale", linear_scale.build(config.sensors.scale, h), linear_scale.LINEAR_SCALE_STATE),
            Block("counter1", None, daq_stc.COUNTER_STATE),
        ),
        (
            "volts = at_mio_16de.output_step(p.output, s.output, tx.ao_codes[0], p.plant.h)",
            f"forward = (tx.dio_lines >> {config.board.direction_line}) & 1",
            "volts = volts if forward != 0 else -volts",
        ),
        (
            "pulses = ls7084.step(p.encoder, s.encoder, s.own.encoder, p.plant.h)",
            "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
            "pulses = linear_scale.step(p.scale, s.scale, s.own.scale)",
            "daq_stc.counter_step(s.counter1, abs(pulses), pulses > 0)",
        ),
        (
            "rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",
            "rx.counter_codes[1] = daq_stc.counter_step(s.counter1, 0, 1)",
            "rx.lost_counts = s.encoder.lost",
        ),
    )


SOFT = 100.0  # V/m, gain of the law in the break-away test
PROFILE = Profile(
    kind=plant.NAME,
    title="Linear drive unit",
    unit=ldu.UNIT,
    traits=frozenset({SCALE, AMPLIFIER}),
    plant=plant,
    truth=ldu_plant.TRUTH,
    columns=Columns("position", "u_c", ("u",), "speed"),
    still=ldu.SETTLE_FLOOR,
    encoder=lambda config: config.sensors.encoder,
    model=model,
    response=Response(
        Usual(
            5e-3, 0.25, 0.25, (0.9, 250.0), 1000.0, 0.5,
            {"law.position": {"kind": "pd", "gain": 1e3, "tau_d": 0.1, "derivative_filter": 1000.0}},
        ),
        free=("J_m", "M", "k_c", "b_c"),
        band=(0.9, 250.0),  # 12.3 leaves out what is above 250 Hz
        drive=drive,
        params=params,
    ),
    friction=Friction(
        (1.5, 3.0, 6.0, 12.0, 20.0), "V", ldu.radius, SOFT, 1.15, 0.05,
        running={"safety.frozen_time": 0},
        soft={
            "law.position": {"kind": "pi_velocity", "gain": SOFT, "velocity_gain": 0.1 * SOFT},
            "law.friction": {"F_c": 0.0},
        },
    ),
    bandwidth=50.0,
    least=(11.0, 60.0),
    frictionless={"plant.parameters.F_c": 0.0, "law.friction.F_c": 0.0},
    feedforward=("law.friction.F_c", "law.inertia.volts"),
    range=Range(
        position="position", error="position_error", outputs=("u",), counts="encoder_counts", truth="truth_x",
        tensions=(), truth_tensions=(), travel=0.15, jump=0.004, rate=(0.01, 0.06), settle=2.0, tolerance=1.5e-3,
        stretch=20.0, counters=2, inputs=0,
        gains={
            "law.position.gain": (0.7, 1.0), "law.position.velocity_gain": (0.9, 1.05),
            "law.position.tau_i": (1.0, 2.0), "law.shaper.bandwidth": (0.6, 1.0), "law.friction.F_c": (0.85, 1.0),
        },
        knots=((0.0, 0.0), (0.2, 0.0), (0.2, 2e-3), (1.0, 2e-3), (1.0, 0.0), (2.0, 0.0), (3.0, 0.03), (4.0, 0.0)),
    ),
    output=lambda config: config.board.output,
    counts=counts,
    terminals=Terminals(
        (Terminal("drive", "V", "at the amplifier, signed by the direction bit"),),
        (
            Terminal("encoder", "rad", "angle of the capstan's motor encoder"),
            Terminal("scale", "m", "position of the carriage"),
        ),
    ),
    wiring=lambda config: Wiring((config.board.output,), (), counters=2, lines=(config.board.direction_line,)),
    own=own,
    case=case,
    exchange=EXCHANGE,
    duty=DUTY,
)  # fmt: skip
