"""Reference generator: plays a table of knots, then follows setpoints from the command record.

The table is piecewise linear; a step is two knots at one time. Time is k dt from the tick count, so rounding errors
do not accumulate.
In YAML a table is a list of steps, each a jump or, with `ramp`, a straight line at that rate:

    steps: [{at: 0.5 s, to: 1 rad}, {at: 3 s, to: 0, ramp: 2 rad/s}]
    repeat: 6 s

A new `seq` in the command ends the table: the reference goes from where it is to `target` at `rate`, or jumps where
`rate` is 0. `hold` keeps it at a position (arming, so that nothing jumps); `start` begins playback. Table values count
from the position held at the start, unless `relative` is false.

Source: step experiments of thesis 8.3; constant velocity runs of 8.1 and 12.3.
"""

from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick

MOST = 2048  # knots
PLAY, HOLD, MOVE = 0, 1, 2


class StepSettings(Settings):
    at: float = quantity(unit="s", ge=0, help="time from the start of playback")
    to: float = quantity(unit="rad", help="new reference")
    ramp: float | None = quantity(None, unit="rad/s", gt=0, help="rate of the change; a jump if absent")


class MetreStepSettings(StepSettings):
    to: float = quantity(unit="m", help="new reference")
    ramp: float | None = quantity(None, unit="m/s", gt=0, help="rate of the change; a jump if absent")


class ReferenceSettings(Settings):
    steps: list[StepSettings] = Field(default=[], description="changes of the reference, in order of time")
    knots: list[tuple[float, float]] = Field(
        default=[], description="instead of steps: pairs of time (s) and reference"
    )
    repeat: float | None = quantity(None, unit="s", gt=0, help="period of the playback; once if absent")
    relative: bool = Field(default=True, description="values count from the position held when playback starts")


class MetreReferenceSettings(ReferenceSettings):
    steps: list[MetreStepSettings] = Field(default=[], description="changes of the reference, in order of time")  # type: ignore[assignment]


class ReferenceParams(NamedTuple):
    t: np.ndarray  # s, (MOST,), not falling
    r: np.ndarray  # rad or m, (MOST,)
    n: int  # knots in use, at least 1
    period: int  # ticks, 0 for once
    relative: int
    dt: float  # s


SETPOINT = state(seq=int, target=float, rate=float)  # written by the command side: a new seq is a new setpoint

REFERENCE_STATE = state(
    ref=float,  # rad or m
    direction=int,  # sign of the last change, held; 0 before the first
    mode=int,
    k0=int,  # tick at which playback started
    origin=float,  # added to the table
    i=int,  # knot before the present time
    seq=int,  # last setpoint seen
)


def build(settings: ReferenceSettings, dt: float) -> ReferenceParams:
    """Table for a tick of `dt` s. Raises ValueError where times fall, a step comes too soon or it is too long."""
    if settings.steps and settings.knots:
        raise ValueError("a reference takes steps or knots, not both")
    knots = _from_steps(settings.steps) if settings.steps else [(t, r) for t, r in settings.knots] or [(0.0, 0.0)]
    if len(knots) > MOST:
        raise ValueError(f"the table has {len(knots)} knots; {MOST} are the most (a step takes two)")
    t, r = np.zeros(MOST), np.zeros(MOST)
    t[: len(knots)], r[: len(knots)] = [_on_tick(time, dt) for time, _ in knots], [value for _, value in knots]
    if t[0] < 0 or np.any(np.diff(t[: len(knots)]) < 0):
        raise ValueError("the times of the knots must start at 0 or later and not fall")
    period = 0 if settings.repeat is None else round(settings.repeat / dt)
    if period and period * dt < t[len(knots) - 1]:
        raise ValueError(f"repeat {settings.repeat:g} s ends before the table, which takes {t[len(knots) - 1]:g} s")
    return ReferenceParams(t, r, len(knots), period, int(settings.relative), dt)


def _from_steps(steps: Any) -> list[tuple[float, float]]:
    knots = [(0.0, 0.0)]
    for i, change in enumerate(steps):
        end, value = knots[-1]
        if change.at < end:
            raise ValueError(f"step {i + 1} at {change.at:g} s comes before the one before it has ended, at {end:g} s")
        duration = abs(change.to - value) / change.ramp if change.ramp else 0.0
        knots += [(change.at, value), (change.at + duration, change.to)]
    return knots


def _on_tick(time: float, dt: float) -> float:
    """A time meant to be a tick is made exactly k dt, so that a step comes at its tick and not one late."""
    k = round(time / dt)
    return k * dt if abs(time / dt - k) < 1e-6 else time


@tick
def step(p, s, c, k):
    """Reference in rad or m at tick `k`, with the setpoint record `c`."""
    if c.seq != s.seq:
        s.seq = c.seq
        s.mode = MOVE
    ref = s.ref
    if s.mode == PLAY:
        ref = s.origin + _table(p, s, k)
    elif s.mode == MOVE:
        most = c.rate * p.dt if c.rate > 0.0 else np.inf
        ref += min(max(c.target - ref, -most), most)
    if ref > s.ref:
        s.direction = 1
    elif ref < s.ref:
        s.direction = -1
    s.ref = ref
    return ref


@tick
def hold(p, s, position):
    """Make `position` the reference and keep it there until `start` or a new setpoint."""
    s.ref = position
    s.mode = HOLD


@tick
def start(p, s, k):
    """Begin playback at tick `k`, from the reference in force where the table is relative."""
    s.mode = PLAY
    s.k0 = k
    s.i = 0
    s.origin = s.ref if p.relative != 0 else 0.0


@tick
def _table(p, s, k):
    k = k - s.k0
    if p.period > 0:
        k = k % p.period
    t = k * p.dt
    if t < p.t[s.i]:  # a new period
        s.i = 0
    while s.i + 1 < p.n and p.t[s.i + 1] <= t:
        s.i += 1
    i = s.i
    if i + 1 == p.n or t < p.t[i]:
        return p.r[i]
    return p.r[i] + (p.r[i + 1] - p.r[i]) * (t - p.t[i]) / (p.t[i + 1] - p.t[i])
