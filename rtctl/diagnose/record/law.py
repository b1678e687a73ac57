"""Law of the recorded machine, for a simulation in closed loop.

The steps are those of rtctl/laws, in the order of the loop's tick; this module only selects the steps of a law:

    e = ref - x,  u = position law(e, v)
    one motor     u + friction + computed torque + w
    a tape        gain factor u + w + friction, shared out between two motors that pull at the tape

Each command is limited, rounded to the steps of a DAC, and fed back to a position law with anti-windup. One record type
serves all laws: another law needs no compilation.

Source: the `notes` of the exchange format's case.json; rtctl/machines for the laws of the machines of rtctl.
"""

from typing import NamedTuple

import numpy as np

from rtctl.case.laws import MAX_SECTIONS
from rtctl.drivers import at_mio_16de, ldu_amplifier
from rtctl.drivers.at_mio_16de import AnalogOutputParams
from rtctl.drivers.ldu_amplifier import LduAmplifierParams
from rtctl.idiom import record_dtype, state, tick
from rtctl.laws import (
    allocation,
    biquad,
    friction_feedforward,
    gain_schedule,
    hand_over,
    inertia_feedforward,
    limit,
    pd,
    pi_velocity,
    reel_growth,
    shaper,
    tension,
    two_tap,
    velocity,
)
from rtctl.laws.allocation import AllocationParams
from rtctl.laws.friction_feedforward import FrictionFeedforwardParams
from rtctl.laws.gain_schedule import GainScheduleParams
from rtctl.laws.hand_over import HandOverParams
from rtctl.laws.inertia_feedforward import InertiaFeedforwardParams
from rtctl.laws.limit import LimitParams
from rtctl.laws.pd import PdParams
from rtctl.laws.pi_velocity import PiVelocityParams
from rtctl.laws.reel_growth import ReelGrowthParams
from rtctl.laws.shaper import ShaperParams
from rtctl.laws.tension import TensionParams
from rtctl.laws.velocity import VelocityParams

NONE, PD, SECTIONS, PI_VELOCITY = range(4)  # position laws
NO_TAPE, CONSTANT, TAPE = range(3)  # one motor; two motors with a constant pull; two motors with all laws for a tape
EXACT, HALVES_UP, BOARD, AMPLIFIER = range(4)  # quantisation of an output
SECTION = record_dtype(biquad.IDENTITY)


class LawParams(NamedTuple):
    kind: int  # of the position law, NONE to PI_VELOCITY
    tape: int  # NO_TAPE to TAPE: distribution of the command to two motors
    to_unit: float  # from the main sensor's count (or metre) to the reference's unit
    resolution: float  # step of the main sensor, in counts or metres; 0 without quantisation
    shift: float  # share of a count that is added before rounding down
    origin: float  # counts of the main sensor at the start
    two_tap: int  # 1: the speed is the rate of the mean of two samples
    velocity: VelocityParams
    pd: PdParams
    pi_velocity: PiVelocityParams
    n_sections: int
    sections: np.ndarray  # (8,) of SECTION
    shaper: ShaperParams  # of the reference
    computed_torque: float  # V per m/s^2 of the reference
    friction1: FrictionFeedforwardParams  # with CONSTANT for both motors
    friction2: FrictionFeedforwardParams
    reference_speed: VelocityParams
    hand_over: HandOverParams
    gain_schedule: GainScheduleParams
    R1: float  # m, at the first tick
    R2: float
    reels: ReelGrowthParams
    pull1: float  # V, with CONSTANT: constant pull of each motor
    pull2: float
    tension: TensionParams
    inertia: InertiaFeedforwardParams
    allocation: AllocationParams
    limit: LimitParams
    output: AnalogOutputParams
    rounds: int  # EXACT to AMPLIFIER
    amplifier: LduAmplifierParams


LAW_STATE = state(
    u1=float,
    u2=float,
    started=int,
    pd=pd.PD_STATE,
    pi_velocity=pi_velocity.PI_VELOCITY_STATE,
    sections=(biquad.BIQUAD_STATE, MAX_SECTIONS),
    two_tap=two_tap.TWO_TAP_STATE,
    velocity=velocity.VELOCITY_STATE,
    shaper=shaper.SHAPER_STATE,
    friction1=friction_feedforward.FRICTION_FEEDFORWARD_STATE,
    friction2=friction_feedforward.FRICTION_FEEDFORWARD_STATE,
    reference_speed=velocity.VELOCITY_STATE,
    hand_over=hand_over.HAND_OVER_STATE,
    gain_schedule=gain_schedule.GAIN_SCHEDULE_STATE,
    reels=reel_growth.REEL_GROWTH_STATE,
    tension=tension.TENSION_STATE,
    inertia=inertia_feedforward.INERTIA_FEEDFORWARD_STATE,
    allocation=allocation.ALLOCATION_STATE,
    limit1=limit.LIMIT_STATE,
    limit2=limit.LIMIT_STATE,
)


@tick
def step(p, s, ref, w, reading):  # no array argument: its reference count would cost as much as the law
    """Write the voltages of one tick, V, into s.u1 and s.u2; `reading` is the main sensor's, in counts or metres."""
    if p.resolution > 0.0:
        reading = (np.floor(reading / p.resolution + p.shift) + p.origin) * p.resolution
    x = reading * p.to_unit
    if s.started == 0:
        s.started = 1
        shaper.reset(p.shaper, s.shaper, ref)
        reel_growth.start(s.reels, p.R1, p.R2, x)
    if p.kind == NONE:
        return
    if p.shaper.w != 0.0:
        shaper.follow(p.shaper, s.shaper, ref)
    u = _position(p, s, ref - x, x)
    u_f1 = 0.0
    if p.friction1.volts != 0.0 or p.tape == TAPE:  # the hand-over of TAPE uses its direction
        u_f1 = friction_feedforward.step(p.friction1, s.friction1, ref)
    if p.tape == TAPE:
        _tape(p, s, ref, w, x, u, u_f1)
    elif p.tape == CONSTANT:
        allocation.step(p.allocation, s.allocation, u + w + u_f1, p.pull1, p.pull2)
        s.u1 = _written(p, limit.step(p.limit, s.limit1, s.allocation.u1))
        s.u2 = _written(p, limit.step(p.limit, s.limit2, s.allocation.u2))
    else:
        u_c = u + (u_f1 + p.computed_torque * s.shaper.acceleration) + w
        u = limit.step(p.limit, s.limit1, u_c)
        if p.kind == PI_VELOCITY:
            pi_velocity.track(p.pi_velocity, s.pi_velocity, u_c, u)
        s.u1 = _written(p, u)


@tick
def _position(p, s, e, x):
    """Command in V of the position law for the error `e` at the position `x`."""
    if p.kind == PD:
        return pd.step(p.pd, s.pd, e)
    if p.kind == SECTIONS:
        for i in range(p.n_sections):
            e = biquad.step(p.sections[i], s.sections[i], e)
        return e
    v = velocity.step(p.velocity, s.velocity, two_tap.step(s.two_tap, x) if p.two_tap != 0 else x)
    return pi_velocity.step(p.pi_velocity, s.pi_velocity, e, v)


@tick
def _tape(p, s, ref, w, x, u, u_f1):
    """Voltages of the two motors for the command `u` of the position law."""
    reel_growth.step(p.reels, s.reels, x)
    R1, R2 = s.reels.R1, s.reels.R2
    u *= gain_schedule.step(p.gain_schedule, s.gain_schedule, R1, R2, u)
    u_f2 = friction_feedforward.step(p.friction2, s.friction2, ref)
    speed = velocity.step(p.reference_speed, s.reference_speed, ref)
    hand_over.step(p.hand_over, s.hand_over, u_f1, u_f2, s.friction1.direction > 0.0, speed, R1, R2)
    tension.step(p.tension, s.tension, R1, R2)
    inertia_feedforward.step(p.inertia, s.inertia, s.shaper.acceleration, R1, R2)
    T1 = s.tension.V1 + s.inertia.u1 + s.hand_over.u1
    T2 = s.tension.V2 + s.inertia.u2 + s.hand_over.u2
    allocation.step(p.allocation, s.allocation, u + w + s.hand_over.u, T1, T2)
    s.u1 = _written(p, limit.step(p.limit, s.limit1, s.allocation.u1))
    s.u2 = _written(p, limit.step(p.limit, s.limit2, s.allocation.u2))


@tick
def _written(p, u):
    """Voltage of an output for a command of `u` V, V."""
    if p.rounds == HALVES_UP:  # as in the exchange format; the board rounds halves to even
        code = np.floor(u / p.output.volts_per_code + 0.5)
        return min(max(code, float(p.output.code_min)), float(p.output.code_max)) * p.output.volts_per_code
    if p.rounds == BOARD:
        return at_mio_16de.codes_to_volts(p.output, at_mio_16de.volts_to_codes(p.output, u))
    if p.rounds == AMPLIFIER:
        codes = at_mio_16de.volts_to_codes(p.output, ldu_amplifier.encode(p.amplifier, u))
        volts = at_mio_16de.codes_to_volts(p.output, codes)
        return volts if ldu_amplifier.direction(p.amplifier, u) != 0 else -volts
    return u


@tick
def play(p, s, ref, w, reading, volts):
    """Write the voltages (n, drives) for recorded columns (n,), tick by tick."""
    for k in range(len(ref)):
        step(p[0], s[0], ref[k], w[k], reading[k])
        volts[k, 0] = s[0].u1
        if volts.shape[1] > 1:
            volts[k, 1] = s[0].u2
