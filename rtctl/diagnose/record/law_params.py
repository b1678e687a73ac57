"""Params of the recorded machine's law, from `controller` of case.json or from the config of our own recordings."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rtctl.case.config_law import ConfigLaw
from rtctl.case.format1 import Case, believed, exchange_of, machine_of
from rtctl.case.laws import CascadeLaw, PdLaw, SectionsLaw
from rtctl.diagnose.record import law
from rtctl.diagnose.record.law import LawParams
from rtctl.drivers import at_mio_16de, ldu_amplifier
from rtctl.drivers.at_mio_16de import AnalogOutputParams
from rtctl.drivers.ldu_amplifier import LduAmplifierParams
from rtctl.idiom import fill_record, record_dtype
from rtctl.laws import (
    allocation,
    friction_feedforward,
    gain_schedule,
    inertia_feedforward,
    limit,
    pd,
    pi_velocity,
    sections,
    shaper,
    tension,
    velocity,
)
from rtctl.laws.allocation import AllocationSettings
from rtctl.laws.friction_feedforward import FrictionFeedforwardParams
from rtctl.laws.gain_schedule import GainScheduleSettings
from rtctl.laws.hand_over import HandOverParams
from rtctl.laws.inertia_feedforward import InertiaFeedforwardParams
from rtctl.laws.limit import LimitParams
from rtctl.laws.pd import PdParams
from rtctl.laws.pi_velocity import PiVelocityParams
from rtctl.laws.reel_growth import ReelGrowthParams
from rtctl.laws.shaper import ShaperParams
from rtctl.laws.tension import TensionParams
from rtctl.laws.velocity import VelocityParams, VelocitySettings
from rtctl.machines.profile import AMPLIFIER, REELS
from rtctl.machines.profiles import profile_of

if TYPE_CHECKING:
    from rtctl.diagnose.record.format1 import Record

TURN = 2 * np.pi  # rad
LARGE = 1e9  # V, limit of a drive of which the owner says none


def per_unit(case: Case) -> list[float]:
    """Counts of each counter a rad or m, those of the description where the case does not say them; 1 for a machine
    without a counter."""
    out = []
    sensors = {sensor.column: sensor for sensor in machine_of(case.plant).sensors.values()}
    for column, scale in exchange_of(case.plant).scales.items():
        said = getattr(case.sensors, scale.key)
        per_unit = sensors[column].counts_per_unit if said is None else said / TURN if scale.per_turn else 1.0 / said
        assert per_unit is not None  # what counts has a scale in its description
        out.append(float(per_unit))
    return out or [1.0]


def law_params(record: "Record") -> LawParams:
    """The law for the compiled step; kind NONE where it is not known."""
    controller = record.case.controller
    if isinstance(controller, ConfigLaw):
        return _of_config(controller.config, record)
    return _of_format(controller, record.case, record.dt)


def began(p: LawParams, record: "Record") -> LawParams:
    """The law for a simulation, whose main sensor begins at 0 where that of the record did not."""
    if p.resolution == 0.0:
        return p
    return p._replace(origin=float(np.floor(next(iter(record.y.values()))[0] / p.resolution + p.shift)))


def law_state(p: LawParams, record: "Record") -> np.ndarray:
    """What the law remembers at the first row (1,), after the rows before it in which it ran already."""
    s, earlier = np.zeros(1, law.LAW_STATE), record.armed
    name, values = next(iter(record.y.items()))
    if p.resolution == 0.0 or not earlier or not len(earlier["t"]) or name not in earlier:
        return s
    reading = earlier[name] + (values[0] - record.columns[name][0])
    written(p._replace(origin=0.0), s, earlier["ref"], earlier["w"], reading, record.u.shape[1])
    x = np.floor(values[0] / p.resolution + p.shift) * p.resolution * p.to_unit
    s["reels"]["R1_0"], s["reels"]["R2_0"], s["reels"]["phi_0"] = p.R1, p.R2, x
    return s


def written(
    p: LawParams, s: np.ndarray, ref: np.ndarray, w: np.ndarray, reading: np.ndarray, drives: int
) -> np.ndarray:
    """The voltages (n, drives) that the law writes from state `s` (1,) on, which it alters, for columns (n,)."""
    params, volts = np.zeros(1, record_dtype(p)), np.zeros((len(ref), drives))
    fill_record(params[0], p)
    columns = (np.array(c, float) for c in (ref, w, reading))  # those of a file cannot be written to: another type
    law.play(params, s, *columns, volts)
    return volts


def plain(case: Case, dt: float) -> LawParams:
    """A law that writes nothing, with the units of a case."""
    return neutral(1 / per_unit(case)[0], dt)


def neutral(to_unit: float, dt: float) -> LawParams:
    """A law that writes nothing, each part in its neutral place; `to_unit` is the reference for one unit of reading."""
    return LawParams(
        kind=law.NONE,
        tape=law.NO_TAPE,
        to_unit=to_unit,
        resolution=0.0,
        shift=0.0,
        origin=0.0,
        two_tap=0,
        velocity=VelocityParams(1.0, dt),
        pd=PdParams(0.0, 0.0, 1.0, dt),
        pi_velocity=PiVelocityParams(0.0, 0.0, 0.0, 0.0),
        n_sections=0,
        sections=np.zeros(law.MAX_SECTIONS, law.SECTION),
        shaper=ShaperParams(1.0, 0.0),
        computed_torque=0.0,
        friction1=FrictionFeedforwardParams(0.0),
        friction2=FrictionFeedforwardParams(0.0),
        reference_speed=VelocityParams(1.0, dt),
        hand_over=HandOverParams(math.inf, 0.0),
        gain_schedule=gain_schedule.build(GainScheduleSettings(), dt),
        R1=1.0,
        R2=1.0,
        reels=ReelGrowthParams(0.0, 0.0),
        pull1=0.0,
        pull2=0.0,
        tension=TensionParams(0.0, 1.0, 1.0),
        inertia=InertiaFeedforwardParams(0.0),
        allocation=allocation.build(AllocationSettings(), dt),
        limit=LimitParams(-LARGE, LARGE, math.inf),
        output=AnalogOutputParams(0.0, 0, 0, 0, 0.0, 0.0),
        rounds=law.EXACT,
        amplifier=LduAmplifierParams(0, 0, LARGE),
    )


def _of_format(c: Any, case: Case, dt: float) -> LawParams:
    """A law in the words of the exchange format."""
    p, drive = plain(case, dt), case.drive
    most, step = drive.limit_volt or LARGE, drive.step_volt
    p = p._replace(limit=LimitParams(-most, most, math.inf))
    if step is not None:
        half = round(drive.dac_range_volt / step)
        p = p._replace(
            rounds=law.HALVES_UP, output=p.output._replace(volts_per_code=step, code_min=-half, code_max=half - 1)
        )
    if isinstance(c, PdLaw):
        believes = believed(case)
        volts = [1.0 / (believes[f"K_m{i}"] * drive.amp_per_volt[i - 1]) for i in (1, 2)]
        friction = FrictionFeedforwardParams(c.friction_Nm * volts[0], held=0)
        return p._replace(
            kind=law.PD, tape=law.CONSTANT, pd=pd.of_gains(c.P, c.D, c.derivative_filter_hz, dt),
            friction1=friction,
            pull1=c.tension_N * believes["R1"] * volts[0], pull2=c.tension_N * believes["R2"] * volts[1],
            allocation=allocation.build(AllocationSettings(kind=c.allocation), dt),
        )  # fmt: skip
    if isinstance(c, SectionsLaw):
        radius = exchange_of(case.plant).radius
        return _with_sections(p._replace(to_unit=p.to_unit * (believed(case)[radius] if radius else 1.0)), c.sections)
    if isinstance(c, CascadeLaw):
        return p._replace(kind=law.PI_VELOCITY, two_tap=1, pi_velocity=PiVelocityParams(c.kp * c.kv, 0.0, c.kv, 0.0))
    return p


def _with_sections(p: LawParams, coefficients: Any) -> LawParams:
    """The same with biquads (b0, b1, b2, a1, a2) in their order."""
    for i, section in enumerate(coefficients):
        p.sections[i] = tuple(section)
    return p._replace(kind=law.SECTIONS, n_sections=len(coefficients))


def _of_config(config: Any, record: "Record") -> LawParams:
    """The law of one of our own machines."""
    case, dt = record.case, record.dt
    p = of_settings(plain(case, dt), config.law, dt)._replace(rounds=law.BOARD)
    profile = profile_of(config.kind)
    if profile.has(REELS):
        return _with_tape(p, config, record)
    return _amplified(p, config, dt) if profile.has(AMPLIFIER) else _plain(p, config, dt)


def of_settings(p: LawParams, settings: Any, dt: float) -> LawParams:
    """The same with position law, speed filter, limit and shaper of a config's `law`."""
    return _position(p, settings, dt)._replace(
        velocity=velocity.build(settings.velocity, dt),
        limit=limit.build(settings.limit, dt),
        shaper=shaper.build(settings.shaper, dt),
    )


def _position(p: LawParams, settings: Any, dt: float) -> LawParams:
    position, kind = settings.position, getattr(settings.position, "kind", "pd")
    if kind == "pi_velocity":
        return p._replace(kind=law.PI_VELOCITY, pi_velocity=pi_velocity.build(position, dt))
    if kind == "sections":
        return _with_sections(p, sections.build(position, dt)[: len(position.sections)])
    return p._replace(kind=law.PD, pd=pd.build(position, dt))


def _plain(p: LawParams, config: Any, dt: float) -> LawParams:
    """Of one drive that takes volts."""
    return p._replace(resolution=config.encoder.pitch, output=at_mio_16de.build_output(config.output, dt))


def _amplified(p: LawParams, config: Any, dt: float) -> LawParams:
    """Of one drive behind an amplifier with a direction bit."""
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
    """Of two motors that pull at a tape."""
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
        tension=tension.build(settings.tension, dt)._replace(ramp=1.0),  # full long before the loop runs
        inertia=inertia_feedforward.build(settings.inertia, dt),
        allocation=allocation.build(settings.allocation, dt),
        output=at_mio_16de.build_output(config.board.output1, dt),
    )
