"""Params of a law by its parts, from a case or a config, for the compiled step of rtctl/diagnose/record/law.py."""

import math
from typing import Any

import numpy as np

from rtctl.case.laws import CascadeLaw, PdLaw, SectionsLaw
from rtctl.diagnose.record import law
from rtctl.diagnose.record.law import LawParams
from rtctl.drivers.at_mio_16de import AnalogOutputParams
from rtctl.drivers.ldu_amplifier import LduAmplifierParams
from rtctl.idiom import fill_record, record_dtype
from rtctl.laws import allocation, gain_schedule, limit, pd, pi_velocity, sections, shaper, velocity
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
from rtctl.laws.velocity import VelocityParams

LARGE = 1e9  # V, limit of a drive without a declared limit


def neutral(to_unit: float, dt: float) -> LawParams:
    """Params of a law without output, each part neutral; `to_unit` is the reference for one unit of reading."""
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


def limited(p: LawParams, most: float | None, step: float | None, full: float) -> LawParams:
    """Params with commands of at most `most`, in steps of `step` between minus and plus `full`; None for neither."""
    high = most or LARGE
    p = p._replace(limit=LimitParams(-high, high, math.inf))
    if not step:
        return p
    half = round(full / step)
    output = p.output._replace(volts_per_code=step, code_min=-half, code_max=half - 1)
    return p._replace(rounds=law.HALVES_UP, output=output)


def of_case(p: LawParams, said: Any, dt: float) -> LawParams:
    """Params with the position law of a case (rtctl.case.laws); unchanged for an unknown law."""
    if isinstance(said, PdLaw):
        return p._replace(kind=law.PD, pd=pd.of_gains(said.P, said.D, said.derivative_filter_hz, dt))
    if isinstance(said, SectionsLaw):
        return _with_sections(p, said.sections)
    if isinstance(said, CascadeLaw):
        gains = PiVelocityParams(said.kp * said.kv, 0.0, said.kv, 0.0)
        return p._replace(kind=law.PI_VELOCITY, two_tap=1, pi_velocity=gains)
    return p


def of_settings(p: LawParams, settings: Any, dt: float) -> LawParams:
    """Params with position law, speed filter, limit and shaper of the `law` of a config."""
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


def _with_sections(p: LawParams, coefficients: Any) -> LawParams:
    """Params with biquads (b0, b1, b2, a1, a2) in their order."""
    for i, section in enumerate(coefficients):
        p.sections[i] = tuple(section)
    return p._replace(kind=law.SECTIONS, n_sections=len(coefficients))


def written(
    p: LawParams, s: np.ndarray, ref: np.ndarray, w: np.ndarray, reading: np.ndarray, drives: int
) -> np.ndarray:
    """Voltages (n, drives) of the law for columns (n,), from state `s` (1,) on, which is updated."""
    params, volts = np.zeros(1, record_dtype(p)), np.zeros((len(ref), drives))
    fill_record(params[0], p)
    columns = (np.array(c, float) for c in (ref, w, reading))  # read-only columns of a file are of another type
    law.play(params, s, *columns, volts)
    return volts
