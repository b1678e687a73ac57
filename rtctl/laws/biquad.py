"""Second-order section, shared by the lead-lag, notch and low-pass filters.

    y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] - a2 y[k-2]

Direct form I, evaluated from left to right. The order of operations is part of the exchange format: a recording
recomputed from `controller.sections` is bit-identical.

Source: Oppenheim & Schafer, Discrete-Time Signal Processing, section 6.3.
"""

from collections.abc import Sequence
from math import pi, tan
from typing import Literal, NamedTuple

import numpy as np

from rtctl.idiom import Settings, quantity, state, tick


class BiquadSettings(Settings):
    """A section by its raw coefficients, valid for one sample rate only."""

    kind: Literal["biquad"] = "biquad"
    b0: float = quantity(unit="", help="coefficient of x[k]")
    b1: float = quantity(0.0, unit="", help="coefficient of x[k-1]")
    b2: float = quantity(0.0, unit="", help="coefficient of x[k-2]")
    a1: float = quantity(0.0, unit="", help="coefficient of -y[k-1]")
    a2: float = quantity(0.0, unit="", help="coefficient of -y[k-2]")


class BiquadParams(NamedTuple):
    b0: float
    b1: float
    b2: float
    a1: float
    a2: float


IDENTITY = BiquadParams(1.0, 0.0, 0.0, 0.0, 0.0)

BIQUAD_STATE = state(x1=float, x2=float, y1=float, y2=float)  # the last two inputs and outputs


def build(settings: BiquadSettings, dt: float) -> BiquadParams:
    """The coefficients as they are. Raises ValueError where a pole lies outside the unit circle."""
    p = BiquadParams(settings.b0, settings.b1, settings.b2, settings.a1, settings.a2)
    if abs(p.a2) > 1 or abs(p.a1) > 1 + p.a2:
        raise ValueError(f"section a1={p.a1:g}, a2={p.a2:g} is unstable; expected |a2| <= 1 and |a1| <= 1 + a2")
    return p


Polynomial = Sequence[float] | np.ndarray  # in s, powers falling


def bilinear2(num: Polynomial, den: Polynomial, dt: float, prewarp: float | None = None) -> BiquadParams:
    """Discretise num(s) / den(s), powers of s falling, order at most 2, by the bilinear transform.

    `prewarp` in rad/s is the frequency at which the two agree exactly (0 Hz if absent).
    Raises ValueError where `prewarp` is at or above the Nyquist frequency or the order is above 2.
    """
    from scipy.signal import bilinear  # slow to import, and needed here only

    if len(num) > len(den) or len(den) > 3:
        raise ValueError(f"a section is a proper fraction of order 2 at most, not {len(num) - 1} over {len(den) - 1}")
    rate = 1 / dt
    if prewarp is not None:
        check_below_nyquist(prewarp, dt)
        rate = prewarp / (2 * tan(prewarp * dt / 2))
    b, a = (list(map(float, c)) for c in bilinear(num, den, fs=rate))
    b = [0.0] * (len(a) - len(b)) + b  # leading zeros come back trimmed
    b, a = (c + [0.0] * (3 - len(c)) for c in (b, a))
    return BiquadParams(b[0], b[1], b[2], a[1], a[2])


def check_below_nyquist(w: float, dt: float) -> None:
    """Raise ValueError where `w` (rad/s) cannot be represented with a tick of `dt` s."""
    if w * dt >= pi:
        raise ValueError(f"{w / (2 * pi):g} Hz is not below half the sample rate of {1 / dt:g} Hz")


@tick
def step(p, s, x):
    """Output for the input `x`, in units of b0 times `x`."""
    y = p.b0 * x + p.b1 * s.x1 + p.b2 * s.x2 - p.a1 * s.y1 - p.a2 * s.y2
    s.x2 = s.x1
    s.x1 = x
    s.y2 = s.y1
    s.y1 = y
    return y


@tick
def reset(p, s, x):
    """Put the section in its steady state for the constant input `x` and return its output.

    A section with a pole at z = 1 integrates and has no such state: its output starts at 0.
    """
    sum_a = 1.0 + p.a1 + p.a2
    y = 0.0
    if abs(sum_a) > 1e-13:  # rounding of a1 and a2 leaves some 1e-16
        y = (p.b0 + p.b1 + p.b2) / sum_a * x
    s.x1 = x
    s.x2 = x
    s.y1 = y
    s.y2 = y
    return y
