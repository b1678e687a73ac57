"""Profile of the Image Verification Unit: two reels with a motor each, tape over a capstan with an encoder."""

import math
from typing import Any

import numpy as np

from rtctl.drivers import at_mio_16de, daq_stc, l292, ls7084, optical_sensor
from rtctl.drivers.board import Wiring
from rtctl.machines import ivu, ivu_plant
from rtctl.machines.base import Block
from rtctl.machines.ivu_duty import DUTY
from rtctl.machines.ivu_exchange import EXCHANGE
from rtctl.machines.ivu_motion import model
from rtctl.machines.profile import (
    REELS,
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
from rtctl.plants import ivu as plant

EACH = ("J_m1", "J_m2", "c1", "c2", "k1", "k2", "c_m1", "c_m2", "k_m1", "k_m2")  # for both motors at two pairs of radii


def drive(config: Any, f: np.ndarray) -> np.ndarray:
    """Response (n,) of the L292 bridge in A/V at `f` (n,) Hz."""
    s, (K, w, zeta) = 2j * np.pi * f, l292.second_order(config.plant.driver)
    zero = config.plant.driver.R_F * config.plant.driver.C_F
    return K * (1 + s * zero) / (1 + 2 * zeta * s / w + (s / w) ** 2)


def params(settings: Any, R1: float, R2: float) -> Any:
    """Params of the plant at these radii in m; given inertias belong to the initial radii and change with the radii
    (4.1, 4.2)."""
    p = plant.parameters(settings)
    moved: dict[str, float | None] = {"R1": R1, "R2": R2}
    for J, R, was in (("J_1", R1, p.R1), ("J_2", R2, p.R2)):
        moved[J] = getattr(p, J) + 0.5 * np.pi * p.rho_tape * p.h_tape * (R**4 - was**4)
    at = settings.parameters.model_copy(update=moved)
    one = (*l292.second_order(settings.driver), settings.driver.R_F * settings.driver.C_F)
    return plant.build(settings.model_copy(update={"parameters": at}), 1e-3, [one, one])


def counts(config: Any) -> float:
    """Counts of the encoder for a radian of the capstan."""
    return float(config.sensors.capstan.lines * config.sensors.capstan.multiply / (2 * np.pi))


def wiring(config: Any) -> Wiring:
    """Channels of the board."""
    board = config.board
    return Wiring((board.output1, board.output2), (board.reel1, board.reel2), counters=1)


def case(config: Any) -> dict[str, Any]:
    """Keys of case.json: the nominal model of the config."""
    law = config.law
    w, zeta = l292.second_order(config.plant.driver)[1:3]
    parameters = given(plant.parameters(config.plant))
    if not config.plant.follow_tape:
        parameters["d_tape"] = 0.0
    return {
        "parameters": parameters,
        "sensors": {
            "capstan_counts_per_rev": config.sensors.capstan.lines * config.sensors.capstan.multiply,
            "reel_counts_per_rev": config.sensors.reel1.pulses,
        },
        "drive": {
            "amp_per_volt": [law.tension.amp_per_volt, law.tension.amp_per_volt],
            "limit_volt": law.limit.high,
            "dac_bits": 12,
            "bandwidth_hz": w / (2 * math.pi),
            "damping": zeta,
        },
        "controller": position(law)
        | {
            "tension_N": law.tension.F_t,
            "friction_Nm": law.friction.motor1.tau_C,
            "allocation": law.allocation.kind,
        },
    }


def own(config: Any, h: float, seed: int) -> OwnBlocks:
    """Converters, encoder and optical sensors around a user's plant."""
    board = config.board
    return OwnBlocks(
        (
            Block("output1", at_mio_16de.build_output(board.output1, h), at_mio_16de.ANALOG_OUTPUT_STATE),
            Block("output2", at_mio_16de.build_output(board.output2, h), at_mio_16de.ANALOG_OUTPUT_STATE),
            Block("capstan", ls7084.build(config.sensors.capstan, h), ls7084.LS7084_STATE),
            Block("counter0", None, daq_stc.COUNTER_STATE),
            Block("reel1", optical_sensor.build(config.sensors.reel1, h), None),
            Block("reel2", optical_sensor.build(config.sensors.reel2, h), None),
            *(
                Block(name, at_mio_16de.build_input(wire, h, board.dither, i, seed), at_mio_16de.ANALOG_INPUT_STATE)
                for i, (name, wire) in enumerate((("input1", board.reel1), ("input2", board.reel2)))
            ),
        ),
        tuple(
            f"u{i} = at_mio_16de.output_step(p.output{i}, s.output{i}, tx.ao_codes[{i - 1}], p.plant.h)" for i in (1, 2)
        ),
        (
            "pulses = ls7084.step(p.capstan, s.capstan, s.own.capstan, p.plant.h)",
            "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
        ),
        (
            "rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",
            *(
                f"rx.ai_codes[{i - 1}] = at_mio_16de.input_step("
                f"p.input{i}, s.input{i}, optical_sensor.volts(p.reel{i}, s.own.reel{i}))"
                for i in (1, 2)
            ),
            "rx.lost_counts = s.capstan.lost",
        ),
    )


SOFT = 0.8  # V/rad, gain of the law in the break-away test
PROFILE = Profile(
    kind=plant.NAME,
    title="Image verification unit",
    unit=ivu.UNIT,
    traits=frozenset({REELS}),
    plant=plant,
    truth=ivu_plant.TRUTH,
    columns=Columns("capstan", "u_c", ("u1", "u2"), "capstan_speed"),
    error="capstan_error",
    still=3 * 2 * np.pi / 10_000,  # rad, three counts of the encoder
    pairs={name: (f"{name}1", f"{name}2") for name in ("J_m", "c_m", "k_m", "c", "k", "K_m")},
    encoder=lambda config: config.sensors.capstan,
    model=model,
    response=Response(
        Usual(  # at 2 rad/s a period would hold a whole number of counts, and rounding would look like distortion
            1.97, 1.0, 1.2, (0.4, 60.0), 240.0, 2.2,
            {"law.position": {"gain": 5.0, "tau_d": 0.1, "derivative_filter": 40.0}, "law.tension.F_t": 0.6,
             "law.gain_schedule.mode": "off"},
            most=5.0,
        ),
        free=("J_m", "c", "k", "c_m", "k_m"),
        band=(0.4, 60.0),  # 8.1 leaves out what is above 60 Hz
        drive=drive,
        params=params,
        each=EACH,
    ),
    friction=Friction(
        (0.15, 0.3, 0.6, 1.2, 2.4, 4.0), "Nm", lambda config: 1.0, SOFT, 1.0, 0.01,
        running={"safety.current_time": 0},
        soft={
            "law.position": {"gain": SOFT, "tau_d": 0.1, "derivative_filter": 10.0},
            "law.friction": {"motor1": {"tau_C": 0.0}, "motor2": {"tau_C": 0.0}},
            "law.inertia": {},
            "law.gain_schedule": {"mode": "off"},
        },
    ),
    bandwidth=2.0,
    frictionless={
        "plant.parameters.tau_F1": 0.0,
        "plant.parameters.tau_F2": 0.0,
        "plant.parameters.tau_Fc": 0.0,
        "law.friction.motor1.tau_C": 0.0,
        "law.friction.motor2.tau_C": 0.0,
    },
    alone={"law.allocation.kind": "motor1"},
    feedforward=("law.friction.motor1.tau_C", "law.friction.motor2.tau_C", "law.inertia.share"),
    range=Range(
        position="capstan", error="capstan_error", outputs=("u1", "u2"), counts="capstan_counts",
        truth="truth_capstan", tensions=("tension1_estimate", "tension2_estimate"),
        truth_tensions=("truth_tension1", "truth_tension2"), travel=10.0, jump=4.0, rate=(0.5, 8.0), settle=2.0,
        tolerance=0.05, stretch=2.0, counters=1, inputs=2,
        gains={
            "law.position.gain": (0.7, 1.1), "law.position.tau_d": (0.8, 1.2), "law.shaper.bandwidth": (0.6, 1.0),
            "law.tension.F_t": (0.8, 2.0), "law.friction.motor1.tau_C": (0.8, 1.0),
        },
        measure=("radius.source", "measured"),
        knots=((0.0, 0.0), (0.2, 0.0), (0.2, 1.0), (2.0, 1.0), (2.0, 0.0), (4.0, 0.0), (5.0, -2.0), (6.0, 0.0)),
    ),
    output=lambda config: config.board.output1,
    counts=counts,
    terminals=Terminals(
        (
            Terminal("drive1", "V", "at the driver of motor 1, -10 to 10 V, 0.2 A/V"),
            Terminal("drive2", "V", "at the driver of motor 2, -10 to 10 V, 0.2 A/V"),
        ),
        (
            Terminal("encoder", "rad", "angle of the capstan"),
            Terminal("reel1", "rad", "angle of reel 1"),
            Terminal("reel2", "rad", "angle of reel 2"),
        ),
    ),
    wiring=wiring,
    own=own,
    case=case,
    exchange=EXCHANGE,
    duty=DUTY,
)  # fmt: skip
