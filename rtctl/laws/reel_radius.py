"""Reel radii at start-up: wind the tape a little in one direction and compare the angles of reels and capstan.

    tighten   both motors pull with the tension voltages
    pull      one motor adds `drive`, rising slowly, until the capstan has turned 1.9 rad
    brake     drive falls again, the velocity feedback brakes, the tape comes to rest; optionally pull back
    done      the tension voltages are those of the radii found

    u_c = +-drive - brake v      u1 = T1 + max(u_c, 0)      u2 = T2 + max(-u_c, 0)

The angles are taken at counted edges (`reel_edges`), which leaves an error under 1 % where the plain ratio has 5 %.
The reel sensors have no direction: counting begins after a run-in, when everything moves one way, and begins again
where the tape runs back.

Source: thesis 5.2, 5.3, 6.2. The thesis sets the tension for the smallest radius; here the tension is set for the
largest radius, so that the tape is taut for every radius of the reels.
"""

from math import ceil, pi
from typing import NamedTuple

from pydantic import Field

from rtctl.idiom import quantity, state, tick
from rtctl.laws import reel_edges, velocity
from rtctl.laws.drive import DriveSettings
from rtctl.laws.reel_edges import EDGES_STATE
from rtctl.laws.velocity import VELOCITY_STATE, VelocityParams, VelocitySettings

TIGHTEN, PULL, BRAKE, DONE = 0, 1, 2, 3


class ReelRadiusSettings(DriveSettings):
    R_c: float = quantity(1.25e-2, unit="m", gt=0, help="radius of the capstan")
    R_min: float = quantity(2e-2, unit="m", gt=0, help="smallest radius of a reel")
    R_max: float = quantity(4e-2, unit="m", gt=0, help="largest radius of a reel")
    counts_per_turn: int = Field(default=209, gt=0, description="counts of a reel sensor in a turn")
    F_t: float = quantity(0.1, unit="N", gt=0, help="tape tension, held at rest")
    step_voltage: float = quantity(2.0, unit="V", gt=0, help="most that the pulling motor gets above its tension")
    slew: float = quantity(2.0, unit="V/s", gt=0, help="rise and fall of every voltage")
    brake: float = quantity(0.4, unit="V*s/rad", gt=0, help="velocity feedback; limits the speed too")
    travel: float = quantity(1.9, unit="rad", gt=0, help="capstan angle to turn")
    run_in: float = quantity(0.1, unit="rad", ge=0, help="capstan angle before counting begins")
    settle: float = quantity(0.5, unit="s", gt=0, help="time to stand still before going on")
    rest: float = quantity(5e-3, unit="rad", gt=0, help="movement that still counts as standing still")
    timeout: float = quantity(10.0, unit="s", gt=0, help="longest time for pulling or braking")
    both_ways: bool = Field(default=True, description="measure back too; ends near where it began")


class ReelRadiusParams(NamedTuple):
    velocity: VelocityParams
    R_c: float  # m
    R_low: float  # m, an estimate below is wrong
    R_high: float  # m, an estimate above is wrong
    angle: float  # rad per count of a reel
    tension: float  # V per m of radius
    T_max: float  # V, tension voltage of the largest reel
    u_step: float  # V
    slew: float  # V per tick
    brake: float  # V s/rad
    travel: float  # rad
    run_in: float  # rad
    rest: float  # rad
    settle: int  # ticks
    timeout: int  # ticks
    runs: int


REEL_RADIUS_STATE = state(
    phase=int,
    failed=int,  # 1 after a timeout or an impossible radius
    u1=float,  # V, to write
    u2=float,
    R1=float,  # m, 0 until estimated
    R2=float,
    T1=float,  # V, tension
    T2=float,
    drive=float,  # V above the tension
    direction=float,  # of the capstan: -1 motor 2 pulls, 1 motor 1 pulls
    ticks=int,  # periods in this phase
    still=int,  # ticks at rest
    run=int,  # runs finished
    velocity=VELOCITY_STATE,  # of the capstan
    phi_from=float,  # rad, where this run started
    phi_rest=float,  # rad, where the tape was last seen to move
    far=float,  # rad, furthest travel of this run
    reel1=EDGES_STATE,
    reel2=EDGES_STATE,
)


def build(settings: ReelRadiusSettings, dt: float) -> ReelRadiusParams:
    """Parameters for a tick of `dt` s. Raises ValueError where the travel is too short to count on."""
    angle = 2 * pi / settings.counts_per_turn
    counts = settings.travel * settings.R_c / settings.R_max / angle
    if counts < 4:
        raise ValueError(
            f"a travel of {settings.travel:g} rad turns a reel of {settings.R_max:g} m by {counts:.1f} counts; "
            f"take {settings.travel * 4 / counts:.2g} rad or more"
        )
    tension = settings.F_t / settings.torque_per_volt
    T_max = tension * settings.R_max
    return ReelRadiusParams(
        # 5 Hz: slow enough for one count of the capstan to be no jerk
        velocity=velocity.build(VelocitySettings(filter=5.0), dt),
        R_c=settings.R_c,
        R_low=0.8 * settings.R_min,
        R_high=1.2 * settings.R_max,
        angle=angle,
        tension=tension,
        T_max=T_max,
        u_step=settings.step_voltage,
        slew=settings.slew * dt,
        brake=settings.brake,
        travel=settings.travel,
        run_in=settings.run_in,
        rest=settings.rest,
        settle=ceil((settings.settle + T_max / settings.slew) / dt),
        timeout=ceil(settings.timeout / dt),
        runs=2 if settings.both_ways else 1,
    )


@tick
def step(p, s, phi_c, n1_counts, n2_counts, passed=1):
    """Advance one tick; returns 1 when done (then look at s.failed), else 0. Write s.u1 and s.u2, V.

    `phi_c` is the capstan angle in rad, the counts are those of the reel sensors, rising in either direction. `passed`
    is the number of periods since the tick before; the time-out counts them.
    """
    middle = 0.5 * (s.velocity.x + phi_c)  # an edge came somewhere within the tick
    v = velocity.step(p.velocity, s.velocity, phi_c, passed)
    s.ticks += passed
    s.T1 = _towards(s.T1, p.tension * s.R1 if s.R1 > 0.0 else p.T_max, p.slew)
    s.T2 = _towards(s.T2, p.tension * s.R2 if s.R2 > 0.0 else p.T_max, p.slew)
    s.drive = _towards(s.drive, p.u_step if s.phase == PULL else 0.0, p.slew)

    count = 0
    if s.phase == PULL:
        count = _travel(p, s, phi_c)
    reel_edges.follow(s.reel1, middle, n1_counts, count)
    reel_edges.follow(s.reel2, middle, n2_counts, count)

    if s.phase == PULL:
        if s.far >= p.run_in + p.travel and s.reel1.seen > 1 and s.reel2.seen > 1:
            _estimate(p, s)
            _enter(s, BRAKE)
    elif _at_rest(p, s, phi_c):
        _go_on(p, s, phi_c)
    if s.ticks > p.timeout and s.phase != DONE:
        s.failed = 1
        _enter(s, BRAKE if s.phase == PULL else DONE)

    u_c = 0.0 if s.phase == TIGHTEN else s.direction * s.drive - p.brake * v
    s.u1 = s.T1 + max(u_c, 0.0)
    s.u2 = s.T2 + max(-u_c, 0.0)
    return 1 if s.phase == DONE else 0


@tick
def _travel(p, s, phi_c):
    """1 where the tape runs one way and counts are valid; begins again where the tape has run back."""
    travel = s.direction * (phi_c - s.phi_from)
    s.far = max(s.far, travel)
    if s.far - travel > p.rest:
        _from_here(s, phi_c)
    return 1 if s.far >= p.run_in else 0


@tick
def _at_rest(p, s, phi_c):
    if s.drive > 0.0 or abs(phi_c - s.phi_rest) > p.rest:
        s.phi_rest = phi_c
        s.still = 0
    s.still += 1
    return s.still > p.settle


@tick
def _go_on(p, s, phi_c):
    """Start the first run, or the run back, or end."""
    if s.phase == TIGHTEN or (s.phase == BRAKE and s.failed == 0 and s.run < p.runs):
        s.direction = -1.0 if s.phase == TIGHTEN else -s.direction
        _from_here(s, phi_c)
        _enter(s, PULL)
    else:
        _enter(s, DONE)


@tick
def _estimate(p, s):
    """Include this run in the mean of the runs."""
    R1 = reel_edges.radius(s.reel1, p.R_c, p.angle)
    R2 = reel_edges.radius(s.reel2, p.R_c, p.angle)
    s.run += 1
    s.R1 += (R1 - s.R1) / s.run
    s.R2 += (R2 - s.R2) / s.run
    if min(R1, R2) < p.R_low or max(R1, R2) > p.R_high:
        s.failed = 1


@tick
def _from_here(s, phi_c):
    s.phi_from = phi_c
    s.far = 0.0
    reel_edges.clear(s.reel1)
    reel_edges.clear(s.reel2)


@tick
def _enter(s, phase):
    s.phase = phase
    s.ticks = 0
    s.still = 0


@tick
def _towards(x, target, most):
    return x + min(max(target - x, -most), most)


@tick
def reset(p, s):
    """Begin again from the tension in force."""
    velocity.reset(p.velocity, s.velocity)
    s.failed = 0
    s.R1 = 0.0
    s.R2 = 0.0
    s.drive = 0.0
    s.run = 0
    _enter(s, TIGHTEN)
