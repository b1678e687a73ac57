"""The Image Verification Unit at 500 Hz: a board, two drivers, a capstan encoder, two reel sensors, one PD loop.

Block diagram of the tick, thesis figure 5.1:

    reference -> shaper -> error -> PD -> + friction + excitation -> allocation to two motors (+ tension) -> limits
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.drivers import at_mio_16de, daq_stc, ls7084, optical_sensor
from rtctl.idiom import state, tick
from rtctl.laws import (
    allocation,
    bumpless,
    friction_feedforward,
    gain_schedule,
    hand_over,
    inertia_feedforward,
    limit,
    reel_growth,
    reel_radius,
    reference,
    shaper,
    tension,
    tension_estimate,
    velocity,
)
from rtctl.laws.velocity import VelocitySettings
from rtctl.machines import compensation
from rtctl.machines.base import (
    COMMON_COLUMNS,
    Block,
    Column,
    Diagram,
    Signals,
)
from rtctl.machines.ivu_motion import mechanics
from rtctl.machines.ivu_plant import plant_diagram, substeps
from rtctl.machines.ivu_settings import IvuConfig
from rtctl.machines.ivu_stages import LAW_SIGNALS, NAMES, stages
from rtctl.own import law as own_law
from rtctl.tick import safety

__all__ = ["IvuConfig", "diagram", "mechanics", "plant_diagram", "substeps"]

PLANT_RATE = 2000.0  # Hz, of the free-running emulator; a sample is at most half a millisecond old
UNIT = "rad"
SLOW = 0.3  # rad/s of the capstan, below which the reels may oscillate; their sensors count up in either direction
STRETCH = 0.05  # m of tape, after which the comparison of capstan and reels restarts; the radii are not exact
SETTLE_FLOOR = 0.0  # rad, least settling band; 0: two percent of the step


def radius(config: IvuConfig) -> float:
    """Radius that turns metres of tape into radians of the capstan."""
    return config.R_c


def signals(config: Any) -> Signals:
    """Columns by which a run is judged."""
    return Signals("capstan", "capstan_error", ("u1", "u2"), "truth_capstan")


def unit(config: Any) -> str:
    """Unit of reference and position."""
    return UNIT


def metres_per_unit(config: IvuConfig) -> float:
    """Metres of tape per radian of the capstan."""
    return config.R_c


class IvuParams(NamedTuple):
    measure: int
    R1: float
    R2: float
    grow: float  # d_tape R_c / pi: R^2 grows by this per rad of capstan
    core: float  # m, radius of a reel without tape
    trail_speed: float
    hand_over: float
    settle: int  # ticks from arming to running
    R_c: float
    fast: float  # rad/s of a reel near which its sensor misses edges


IVU_STATE = state(
    k_run=int, gains=int, play=int, prepared=int, u_fb=float,
    R1=float, R2=float, R1_0=float, R2_0=float, phi_0=float,  # as in REEL_GROWTH_STATE
    direction=int, phi_1=float, n1=int, n2=int,  # start of the motion in one direction
    R1_given=float, R2_given=float,  # given radii at the last start
)  # fmt: skip


@tick
def switch_on(p, s, phi):
    """Reset all laws to the capstan's angle `phi` in rad, in the tick in which outputs come on."""
    reference.hold(0, s.reference, phi)
    shaper.reset(p.shaper, s.shaper, phi)
    velocity.reset(p.velocity, s.velocity)
    velocity.reset(p.velocity, s.acceleration)
    velocity.reset(p.velocity, s.reference_speed)
    friction_feedforward.reset(p.friction1, s.friction1)
    friction_feedforward.reset(p.friction2, s.friction2)
    tension.reset(p.tension, s.tension)
    bumpless.reset(p.bumpless, s.bumpless)
    reel_radius.reset(p.reel_radius, s.reel_radius)
    s.reel_radius.T1, s.reel_radius.T2 = 0.0, 0.0  # no tension is in force: the outputs were off
    limit.reset(p.limit, s.limit1, 0.0)
    limit.reset(p.limit, s.limit2, 0.0)
    s.machine.prepared = 0
    s.machine.u_fb = 0.0  # it may be NaN after such a trip
    m = s.machine
    if m.R1_given != p.machine.R1 or m.R2_given != p.machine.R2:  # else the radii have been tracked since
        m.R1_given, m.R2_given = p.machine.R1, p.machine.R2
        reel_growth.start(m, p.machine.R1, p.machine.R2, phi)


@tick
def prepare(p, s, phi, n1_counts, n2_counts, k):
    """While armed: measure the radii on request, tighten the tape, then run from the capstan's position."""
    if p.machine.measure != 0 and s.machine.prepared == 0:
        if reel_radius.step(p.reel_radius, s.reel_radius, phi, n1_counts, n2_counts, s.safety.passed) == 0:
            reference.hold(0, s.reference, phi)
            shaper.reset(p.shaper, s.shaper, phi)
            return
        if s.reel_radius.failed != 0:
            safety.trip(s.safety, safety.START_UP, k)
            return
        reel_growth.start(s.machine, s.reel_radius.R1, s.reel_radius.R2, phi)
        reference.hold(0, s.reference, phi)
        shaper.reset(p.shaper, s.shaper, phi)
        s.safety.armed_for = 0
    s.machine.prepared = 1
    if s.safety.armed_for > p.machine.settle:
        s.safety.state = safety.RUNNING
        s.machine.k_run = k


@tick
def play(t, s, c, k):
    """Start the reference table on request while the machine runs; a request while it is off is dropped."""
    if s.safety.state == safety.IDLE or s.safety.state == safety.TRIPPED:
        s.machine.play = c.play
    elif s.safety.state == safety.RUNNING and c.play != s.machine.play:
        reference.start(t.reference, s.reference, k)
        s.machine.play = c.play


@tick
def tape_apart(p, s, phi, speed, n1_counts, n2_counts, R1, R2):
    """Difference in m between the tape by the reels' sensors and by the capstan, over a motion in one direction.

    Elastic stretch of the tape moves one reel ahead of the capstan and the other behind it by an equal length: the sum
    of two differences with opposite signs is free of it. Counts that one sensor or both missed are returned in full.
    """
    m = s.machine
    tape = abs(phi - m.phi_1) * p.machine.R_c
    direction = 1 if speed > SLOW else (-1 if speed < -SLOW else 0)
    blind = abs(speed) * p.machine.R_c > p.machine.fast * min(R1, R2)
    if direction == 0 or direction != m.direction or blind or tape > STRETCH or s.safety.state != safety.RUNNING:
        m.direction, m.phi_1, m.n1, m.n2 = direction, phi, n1_counts, n2_counts
        return 0.0
    apart1 = (n1_counts - m.n1) * p.reel1.radians_per_count * R1 - tape
    apart2 = (n2_counts - m.n2) * p.reel2.radians_per_count * R2 - tape
    return min(abs(apart1 + apart2), max(abs(apart1), abs(apart2)))


COLUMNS = (
    *COMMON_COLUMNS,
    Column("target", "rad", "reference before shaping"),
    Column("ref", "rad", "position reference"),
    Column("w", "V", "excitation added to the controller's output"),
    Column("u1", "V", "written to driver 1, after limits and 12-bit rounding"),
    Column("u2", "V", "written to driver 2, after limits and 12-bit rounding"),
    Column("capstan_counts", "counts", "capstan encoder, up/down, quadrature x4, 0 at the start"),
    Column("reel1_counts", "counts", "optical sensor of reel 1, up in either direction"),
    Column("reel2_counts", "counts", "optical sensor of reel 2, up in either direction"),
    Column("capstan", "rad", "capstan angle"),
    Column("capstan_error", "rad", "ref - capstan"),
    Column("capstan_speed", "rad/s", "filtered difference of the capstan angle"),
    Column("u_c", "V", "command to the capstan, before allocation"),
    Column("R1", "m", "radius of reel 1 that the laws use"),
    Column("R2", "m", "radius of reel 2 that the laws use"),
    Column("gain_factor", "", "factor of the gain schedule"),
    Column("tension1_estimate", "N", "tension at reel 1 from command and motion"),
    Column("tension2_estimate", "N", "tension at reel 2 from command and motion"),
)


class DriveParams(NamedTuple):
    amp_per_volt: float


def diagram(config: IvuConfig, dt: float) -> Diagram:
    """Blocks and lines of the loop's tick. Raises ValueError with the key at fault in the sentence."""
    law, radius = config.law, config.radius
    position = own_law.lines(law.position, "u_pd", LAW_SIGNALS)
    more = compensation.lines(law.compensation, NAMES, config.kind, lambda: mechanics(config, dt), dt)
    at_mio_16de.check_inputs([config.board.reel1, config.board.reel2])
    blocks = (
        Block("machine", _machine_params(config, dt), IVU_STATE),
        Block("safety", safety.build(config.safety, dt), safety.SAFETY_STATE),
        Block("capstan", ls7084.build(config.sensors.capstan, dt), daq_stc.READER_STATE),
        Block("input1", at_mio_16de.build_input(config.board.reel1, dt, False, 0, 0), None),
        Block("input2", at_mio_16de.build_input(config.board.reel2, dt, False, 1, 0), None),
        Block("reel1", optical_sensor.build(config.sensors.reel1, dt), optical_sensor.OPTICAL_SENSOR_STATE),
        Block("reel2", optical_sensor.build(config.sensors.reel2, dt), optical_sensor.OPTICAL_SENSOR_STATE),
        Block("reference", None, reference.REFERENCE_STATE),
        Block("shaper", shaper.build(law.shaper, dt), shaper.SHAPER_STATE),
        Block("reference_speed", velocity.build(VelocitySettings(), dt), velocity.VELOCITY_STATE),
        Block("velocity", velocity.build(law.velocity, dt), velocity.VELOCITY_STATE),
        Block("acceleration", None, velocity.VELOCITY_STATE),
        Block(
            "tension_estimate",
            tension_estimate.build(law.tension_estimate, dt),
            tension_estimate.TENSION_ESTIMATE_STATE,
        ),
        Block("position", position.parts.build(law.position, dt), position.parts.state),
        Block("gain_schedule", gain_schedule.build(law.gain_schedule, dt), gain_schedule.GAIN_SCHEDULE_STATE),
        Block("bumpless", bumpless.build(law.bumpless, dt), bumpless.BUMPLESS_STATE),
        *(
            Block(name, friction_feedforward.build(settings, dt), friction_feedforward.FRICTION_FEEDFORWARD_STATE)
            for name, settings in (("friction1", law.friction.motor1), ("friction2", law.friction.motor2))
        ),
        Block("hand_over", None, hand_over.HAND_OVER_STATE),
        Block("inertia", inertia_feedforward.build(law.inertia, dt), inertia_feedforward.INERTIA_FEEDFORWARD_STATE),
        Block("tension", tension.build(law.tension, dt), tension.TENSION_STATE),
        Block("allocation", allocation.build(law.allocation, dt), allocation.ALLOCATION_STATE),
        Block("reel_radius", reel_radius.build(radius.measure, dt), reel_radius.REEL_RADIUS_STATE),
        Block("limit", limit.build(law.limit, dt), None),
        Block("limit1", None, limit.LIMIT_STATE),
        Block("limit2", None, limit.LIMIT_STATE),
        Block("drive", DriveParams(law.tension.amp_per_volt), None),
        Block("output1", at_mio_16de.build_output(config.board.output1, dt), None),
        Block("output2", at_mio_16de.build_output(config.board.output2, dt), None),
        *more.blocks,
    )  # fmt: skip
    return Diagram((*USES, *more.uses, position.uses), blocks, COLUMNS, stages(position, more))


USES = (
    "rtctl.drivers.at_mio_16de",
    "rtctl.drivers.daq_stc",
    "rtctl.drivers.ls7084",
    "rtctl.drivers.optical_sensor",
    "rtctl.laws.allocation",
    "rtctl.laws.bumpless",
    "rtctl.laws.excitation",
    "rtctl.laws.friction_feedforward",
    "rtctl.laws.gain_schedule",
    "rtctl.laws.hand_over",
    "rtctl.laws.inertia_feedforward",
    "rtctl.laws.limit",
    "rtctl.laws.reel_growth",
    "rtctl.laws.reference",
    "rtctl.laws.shaper",
    "rtctl.laws.tension",
    "rtctl.laws.tension_estimate",
    "rtctl.laws.velocity",
    "rtctl.tick.safety",
)


def _machine_params(config: IvuConfig, dt: float) -> IvuParams:
    r = config.radius
    return IvuParams(
        measure=int(r.source == "measured"),
        R1=r.R1,
        R2=r.R2,
        grow=r.d_tape * config.R_c / np.pi,
        core=r.measure.R_min,
        trail_speed=config.law.friction.speed,
        hand_over=config.law.friction.hand_over,
        settle=round(config.law.tension.ramp / dt) + round(0.1 / dt),
        R_c=config.R_c,
        fast=0.8 * min(optical_sensor.highest_speed(reel, dt) for reel in (config.sensors.reel1, config.sensors.reel2)),
    )
