"""My law: a PD on the position error, with a filtered derivative.

    d += a ((e - e_prev) / (n dt) - d)    a = 1 - exp(-2 pi f dt)
    u  = gain (e + tau_d d)

e is the position error in rad, u the command in V; d is the derivative of e in rad/s. A tick takes dt s;
n periods have passed since the previous one: 1, or more after missed ticks.

The arguments of `step` after p and s select its signals by name: e, and any of x, v, ref, v_ref, a_ref, u, passed.
`rtctl check` reports a name that the machine does not have. Limits and trips act after this law; it cannot bypass them.
"""

from math import exp, pi
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick


class MyLawSettings(Settings):
    """Settings in the config."""

    gain: float = quantity(unit="V/rad", ge=0, help="proportional gain")
    tau_d: float = quantity(0.0, unit="s", ge=0, help="derivative time")
    derivative_filter: float = quantity(40.0, unit="Hz", gt=0, help="corner of the derivative's filter")


class MyLawParams(NamedTuple):
    """Params of a tick."""

    gain: float  # V/rad
    tau_d: float  # s
    a: float  # share of the new difference that enters d each tick
    dt: float  # s


MY_LAW_STATE = state(e=float, d=float, primed=int)  # error, its filtered derivative, 1 once e is known


def build(settings: MyLawSettings, dt: float) -> MyLawParams:
    """Params for a tick of `dt` s, made of the settings here only. A ValueError refuses settings."""
    a = 1.0 - exp(-2 * pi * settings.derivative_filter * dt)
    return MyLawParams(settings.gain, settings.tau_d, a, dt)


@tick
def step(p, s, e, passed):
    """Command in V for the position error `e` in rad, `passed` periods after the previous tick."""
    if s.primed == 0:
        s.e = e
        s.primed = 1
    s.d += p.a * ((e - s.e) / (passed * p.dt) - s.d)
    s.e = e
    return p.gain * (e + p.tau_d * s.d)


@tick
def reset(p, s):
    """Reset the state when outputs come on, so that the first step has no derivative."""
    s.d = 0.0
    s.primed = 0
