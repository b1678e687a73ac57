"""Profile of the axis: a drive that takes volts, and one encoder."""

from typing import Any

from rtctl.drivers import at_mio_16de, daq_stc, linear_scale
from rtctl.drivers.board import Wiring
from rtctl.machines import axis
from rtctl.machines.axis_duty import DUTY
from rtctl.machines.axis_exchange import EXCHANGE
from rtctl.machines.base import Block
from rtctl.machines.profile import FREE_UNITS, Columns, Model, OwnBlocks, Profile, Range, Terminal, Terminals
from rtctl.machines.told import given, position, unit_row
from rtctl.plants import axis as plant


def model(config: Any, p: Any, blocks: dict[str, Any], motor: int) -> Model:
    """Model from the voltage to the encoder."""
    A, B = plant.state_space(p)
    return Model(A, B[:, 0], unit_row(len(A), 0))


def case(config: Any) -> dict[str, Any]:
    """Keys of case.json: the nominal model of the config."""
    p = plant.AxisParameters(**config.plant.parameters.model_dump())
    return {
        "parameters": given(p),
        "sensors": {"x_resolution_m": config.encoder.pitch},
        "drive": {"newton_per_volt": p.K, "limit_volt": config.law.limit.high},
        "controller": position(config.law),
    }


def own(config: Any, h: float, seed: int) -> OwnBlocks:
    """Converter, encoder and counter around a user's plant."""
    return OwnBlocks(
        (
            Block("output", at_mio_16de.build_output(config.output, h), at_mio_16de.ANALOG_OUTPUT_STATE),
            Block("encoder", linear_scale.build(config.encoder, h), linear_scale.LINEAR_SCALE_STATE),
            Block("counter0", None, daq_stc.COUNTER_STATE),
        ),
        ("volts = at_mio_16de.output_step(p.output, s.output, tx.ao_codes[0], p.plant.h)",),
        (
            "pulses = linear_scale.step(p.encoder, s.encoder, s.own.x)",
            "daq_stc.counter_step(s.counter0, abs(pulses), pulses > 0)",
        ),
        ("rx.counter_codes[0] = daq_stc.counter_step(s.counter0, 0, 1)",),
    )


PROFILE = Profile(
    kind=plant.NAME,
    title="Axis",
    unit=axis.UNIT,
    traits=frozenset({FREE_UNITS}),
    plant=plant,
    truth=axis.TRUTH,
    columns=Columns("x", "u_c", ("u",), ""),
    model=model,
    bandwidth=5.0,
    frictionless={"plant.parameters.F_c": 0.0},
    range=Range(
        position="x", error="position_error", outputs=("u",), counts="x_counts", truth="truth_x", tensions=(),
        truth_tensions=(), travel=0.3, jump=0.03, rate=(0.02, 0.3), settle=1.0, tolerance=2e-4, stretch=2.0,
        counters=1, inputs=0,
        gains={"law.position.gain": (0.6, 1.1), "law.position.velocity_gain": (0.8, 1.2)},
        knots=((0.0, 0.0), (0.2, 0.0), (0.2, 0.01), (1.0, 0.01), (1.0, 0.0), (2.0, 0.0), (3.0, 0.1), (4.0, 0.0)),
    ),
    output=lambda config: config.output,
    counts=lambda config: float(1.0 / config.encoder.pitch),
    terminals=Terminals((Terminal("drive", "V", "at the drive"),), (Terminal("sensor", "m", "position"),)),
    wiring=lambda config: Wiring((config.output,), (), counters=1),
    own=own,
    case=case,
    exchange=EXCHANGE,
    duty=DUTY,
)  # fmt: skip
