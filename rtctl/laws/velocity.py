"""Velocity estimate: backward difference of a position through a first-order low-pass.

    v += a ((x - x_prev) / (n dt) - v)    a = 1 - exp(-2 pi f dt), or 1 without a filter

n periods have passed since the previous step: 1, or more after missed ticks.

One count of quantisation moves v by a count / dt, and the estimate lags by about dt / 2 + 1 / (2 pi f).

Source: the derivative of thesis 5.4 with its filter, applied to the measured position.
"""

from math import exp, pi
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class VelocitySettings(Settings):
    filter: float | None = quantity(None, unit="Hz", gt=0, help="corner of the low-pass; a plain difference if absent")


class VelocityParams(NamedTuple):
    a: float  # share of the new difference that enters v each tick
    dt: float  # s


VELOCITY_STATE = state(x=float, v=float, primed=int)  # position, velocity, 1 once x is known


def build(settings: VelocitySettings, dt: float) -> VelocityParams:
    """Coefficients for a tick of `dt` s."""
    f = settings.filter
    return VelocityParams(1.0 if f is None else 1.0 - exp(-2 * pi * f * dt), dt)


@tick
def step(p, s, x, passed=1):
    """Velocity in units of `x` per second, `passed` periods after the previous step.

    The first step after a start or a reset gives 0.
    """
    if s.primed == 0:
        s.x = x
        s.primed = 1
    s.v += p.a * (slope(x - s.x, p.dt, passed) - s.v)
    s.x = x
    return s.v


@tick
def slope(change, dt, passed):
    """Rate of a change over `passed` periods of `dt` s, per second."""
    rate = change / dt
    if (
        passed != 1
    ):  # a branch, since another division in every tick made a fused run of the linear drive a fifth slower
        rate /= passed
    return rate


@tick
def reset(p, s):
    """Forget the past: the next step gives 0."""
    s.v = 0.0
    s.primed = 0
