"""PD position law with a filtered derivative.

    d += a ((e - e_prev) / (n dt) - d)    a = 1 - exp(-2 pi f dt), or 1 without a filter
    u  = gain e + D d                     D = gain tau_d

n periods have passed since the previous step: 1, or more after missed ticks. Without n, the motion of several periods
would count as that of one, and the outputs would jump.

The derivative acts on the error, as in the thesis, so a step of the reference gives a kick of gain tau_d a / dt per
unit of step; the first step after a start or a reset gives none. A feedforward is added to what `step` returns.

Source: thesis 5.4, H_c = G (tau_d s + 1); values of section 8.2.
"""

from math import exp, pi
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.laws import velocity


class PdSettings(Settings):
    gain: float = quantity(unit="V/rad", ge=0, help="proportional gain G (P), V per unit of error")
    tau_d: float = quantity(0.0, unit="s", ge=0, help="derivative time; D is gain times tau_d")
    derivative_filter: float | None = quantity(None, unit="Hz", gt=0, help="corner of its filter; none if absent")


class PdMetreSettings(PdSettings):
    """PD law for an error in metres."""

    gain: float = quantity(unit="V/m", ge=0, help="proportional gain G (P), V per unit of error")


class PdParams(NamedTuple):
    gain: float  # V per unit of error
    D: float  # V s per unit of error
    a: float  # share of the new difference that enters d each tick
    dt: float  # s


PD_STATE = state(e=float, d=float, primed=int)  # error, its filtered derivative per s, 1 once e is known


def build(settings: PdSettings, dt: float) -> PdParams:
    """Coefficients for a tick of `dt` s."""
    return of_gains(settings.gain, settings.gain * settings.tau_d, settings.derivative_filter, dt)


def of_gains(P: float, D: float, filter_hz: float | None, dt: float) -> PdParams:
    """Coefficients by gains as the exchange format writes them: `P` in V and `D` in V s, per unit of error."""
    a = 1.0 if filter_hz is None else 1.0 - exp(-2 * pi * filter_hz * dt)
    return PdParams(P, D, a, dt)


def design(K_p: float, w_n: float, zeta: float = 1.0) -> tuple[float, float]:
    """Gain and tau_d (s) that put the closed loop of H_p = K_p / s^2 at `w_n` rad/s with damping `zeta` (5.4).

    K_p in units of position per s^2 per V, as `process_gain` gives it. Raises ValueError where one is not positive.

    Erratum: section 8.2 leaves out the motor driver. By its equations K_p = 25.4 at 1 Hz is per ampere, so G = 6.2 is
    A/rad; with the driver at 0.2 A/V the same loop takes five times as many V/rad.
    """
    if K_p <= 0 or w_n <= 0 or zeta <= 0:
        raise ValueError(f"PD design takes positive K_p, w_n and zeta, not {K_p:g}, {w_n:g} and {zeta:g}")
    return w_n**2 / K_p, 2 * zeta / w_n


@tick
def step(p, s, e, passed=1):
    """Command in V for the position error `e` (rad or m), `passed` periods after the previous step."""
    if s.primed == 0:
        s.e = e
        s.primed = 1
    s.d += p.a * (velocity.slope(e - s.e, p.dt, passed) - s.d)
    s.e = e
    return p.gain * e + p.D * s.d


@tick
def reset(p, s):
    """Forget the past: the next step starts without a derivative."""
    s.d = 0.0
    s.primed = 0
