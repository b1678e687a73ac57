"""Reference shaping: a step becomes a smooth move, so that the tape stays taut and the carriage is not jerked.

    x1 += a (target - x1),  x2 += a (x1 - x2),  ref += a (x2 - ref)         a = 1 - exp(-w dt)

Three equal lags: acceleration and its rate stay bounded (a step of size s asks for at most 0.24 w^2 s), there is no
overshoot, and 99.9 % is reached after 11 / w.

Source: Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, 7.9 (shaping by a prefilter).
"""

from math import exp
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class ShaperSettings(Settings):
    bandwidth: float | None = quantity(
        None, unit="rad/s", gt=0, help="w of the three lags; the reference passes as it is if absent"
    )


class ShaperParams(NamedTuple):
    a: float
    w: float  # rad/s, 0 where nothing is shaped


SHAPER_STATE = state(x1=float, x2=float, ref=float, speed=float, acceleration=float)  # of the shaped reference


def build(settings: ShaperSettings, dt: float) -> ShaperParams:
    """Coefficient for a tick of `dt` s."""
    if settings.bandwidth is None:
        return ShaperParams(1.0, 0.0)
    return ShaperParams(1.0 - exp(-settings.bandwidth * dt), settings.bandwidth)


@tick
def step(p, s, target):
    """Shaped reference for `target`, same unit. Its speed and acceleration are left in the state (0 if not shaped)."""
    s.x1 += p.a * (target - s.x1)
    s.x2 += p.a * (s.x1 - s.x2)
    s.ref += p.a * (s.x2 - s.ref)
    s.speed = p.w * (s.x2 - s.ref)
    s.acceleration = p.w * (p.w * (s.x1 - s.x2) - s.speed)
    return s.ref


@tick
def follow(p, s, ref):
    """Follow the output `ref`: set the state of the shaper, with speed and acceleration, that gives this output."""
    x2 = s.ref + (ref - s.ref) / p.a
    s.x1 = s.x2 + (x2 - s.x2) / p.a
    s.x2 = x2
    s.ref = ref
    s.speed = p.w * (s.x2 - s.ref)
    s.acceleration = p.w * (p.w * (s.x1 - s.x2) - s.speed)


@tick
def reset(p, s, position):
    """Stand at `position`."""
    s.x1 = position
    s.x2 = position
    s.ref = position
    s.speed = 0.0
    s.acceleration = 0.0
