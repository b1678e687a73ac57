"""Params of the law of a recorded machine, from `controller` of case.json or the config of a recording by rtctl."""

from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.case.config_law import ConfigLaw
from rtctl.case.format1 import Case, believed, exchange_of, machine_of
from rtctl.case.laws import SectionsLaw, TapeLaw
from rtctl.diagnose.record import law
from rtctl.diagnose.record.law import LawParams
from rtctl.diagnose.record.law_parts import limited, neutral, of_case, of_settings, written
from rtctl.drivers import at_mio_16de, ldu_amplifier
from rtctl.laws import (
    allocation,
    friction_feedforward,
    gain_schedule,
    inertia_feedforward,
    tension,
    velocity,
)
from rtctl.laws.allocation import AllocationSettings
from rtctl.laws.friction_feedforward import FrictionFeedforwardParams
from rtctl.laws.hand_over import HandOverParams
from rtctl.laws.reel_growth import ReelGrowthParams
from rtctl.laws.velocity import VelocitySettings
from rtctl.machines.profile import AMPLIFIER, REELS
from rtctl.machines.profiles import profile_of

if TYPE_CHECKING:
    from rtctl.diagnose.record.format1 import Record

TURN = 2 * np.pi  # rad


def per_unit(case: Case) -> list[float]:
    """Counts of each counter for one rad or m, from the case, else from the description; 1 for a machine without a
    counter."""
    out = []
    sensors = {sensor.column: sensor for sensor in machine_of(case.plant).sensors.values()}
    for column, scale in exchange_of(case.plant).scales.items():
        said = getattr(case.sensors, scale.key)
        per_unit = sensors[column].counts_per_unit if said is None else said / TURN if scale.per_turn else 1.0 / said
        assert per_unit is not None  # every counter has a scale in its description
        out.append(float(per_unit))
    return out or [1.0]


def law_params(record: "Record") -> LawParams:
    """Params of the law for the compiled step; kind NONE where the law is not known."""
    controller = record.case.controller
    if isinstance(controller, ConfigLaw):
        return _of_config(controller.config, record)
    return _of_format(controller, record.case, record.dt)


def began(p: LawParams, record: "Record") -> LawParams:
    """Params of the law for a simulation, whose main sensor begins at 0: the first recorded count is the origin."""
    if p.resolution == 0.0:
        return p
    return p._replace(origin=float(np.floor(next(iter(record.y.values()))[0] / p.resolution + p.shift)))


def law_state(p: LawParams, record: "Record") -> np.ndarray:
    """State (1,) of the law at the first row, after the earlier rows in which the law ran already."""
    s, earlier = np.zeros(1, law.LAW_STATE), record.armed
    name, values = next(iter(record.y.items()))
    if p.resolution == 0.0 or not earlier or not len(earlier["t"]) or name not in earlier:
        return s
    reading = earlier[name] + (values[0] - record.columns[name][0])
    written(p._replace(origin=0.0), s, earlier["ref"], earlier["w"], reading, record.u.shape[1])
    x = np.floor(values[0] / p.resolution + p.shift) * p.resolution * p.to_unit
    s["reels"]["R1_0"], s["reels"]["R2_0"], s["reels"]["phi_0"] = p.R1, p.R2, x
    return s


def plain(case: Case, dt: float) -> LawParams:
    """Params of a law without output, with the units of a case."""
    return neutral(1 / per_unit(case)[0], dt)


def _of_format(c: Any, case: Case, dt: float) -> LawParams:
    """Params of a law of the exchange format."""
    drive = case.drive
    p = of_case(limited(plain(case, dt), drive.limit_volt, drive.step_volt, drive.dac_range_volt), c, dt)
    if isinstance(c, TapeLaw):
        believes = believed(case)
        volts = [1.0 / (believes[f"K_m{i}"] * drive.amp_per_volt[i - 1]) for i in (1, 2)]
        return p._replace(
            tape=law.CONSTANT,
            friction1=FrictionFeedforwardParams(c.friction_Nm * volts[0], held=0),
            pull1=c.tension_N * believes["R1"] * volts[0], pull2=c.tension_N * believes["R2"] * volts[1],
            allocation=allocation.build(AllocationSettings(kind=c.allocation), dt),
        )  # fmt: skip
    if isinstance(c, SectionsLaw):
        radius = exchange_of(case.plant).radius
        return p._replace(to_unit=p.to_unit * (believed(case)[radius] if radius else 1.0))
    return p


def _of_config(config: Any, record: "Record") -> LawParams:
    """Params of the law of a machine of rtctl."""
    case, dt = record.case, record.dt
    p = of_settings(plain(case, dt), config.law, dt)._replace(rounds=law.BOARD)
    profile = profile_of(config.kind)
    if profile.has(REELS):
        return _with_tape(p, config, record)
    return _amplified(p, config, dt) if profile.has(AMPLIFIER) else _plain(p, config, dt)


def _plain(p: LawParams, config: Any, dt: float) -> LawParams:
    """Params with the output of one drive with a voltage input."""
    return p._replace(resolution=config.encoder.pitch, output=at_mio_16de.build_output(config.output, dt))


def _amplified(p: LawParams, config: Any, dt: float) -> LawParams:
    """Params with the output of one drive behind an amplifier with a direction bit."""
    output, friction = at_mio_16de.build_output(config.board.output, dt), config.law.friction
    return p._replace(
        to_unit=p.to_unit * config.sensors.R_c,
        resolution=1.0,
        shift=0.5,
        friction1=FrictionFeedforwardParams(friction.F_c / friction.newton_per_volt),
        computed_torque=config.law.inertia.volts,
        output=output,
        amplifier=ldu_amplifier.build(config.amplifier, dt, output.volts_per_code),
        rounds=law.AMPLIFIER,
    )


def _with_tape(p: LawParams, config: Any, record: "Record") -> LawParams:
    """Params with the laws of two motors that pull at a tape."""
    settings, dt, radius = config.law, record.dt, config.radius
    R1, R2 = (float(record.columns[n][0]) if n in record.columns else getattr(radius, n) for n in ("R1", "R2"))
    return p._replace(
        tape=law.TAPE,
        resolution=1.0,
        shift=0.5,
        friction1=friction_feedforward.build(settings.friction.motor1, dt),
        friction2=friction_feedforward.build(settings.friction.motor2, dt),
        reference_speed=velocity.build(VelocitySettings(), dt),
        hand_over=HandOverParams(settings.friction.speed, settings.friction.hand_over),
        gain_schedule=gain_schedule.build(settings.gain_schedule, dt),
        R1=R1,
        R2=R2,
        reels=ReelGrowthParams(radius.d_tape * config.R_c / np.pi, radius.measure.R_min),
        tension=tension.build(settings.tension, dt)._replace(ramp=1.0),  # the ramp ends before the loop runs
        inertia=inertia_feedforward.build(settings.inertia, dt),
        allocation=allocation.build(settings.allocation, dt),
        output=at_mio_16de.build_output(config.board.output1, dt),
    )
