"""Second-order low-pass, to roll the loop off above its bandwidth.

    H = w_c^2 / (s^2 + 2 zeta w_c s + w_c^2)

The gain is 1 at rest and 1 / (2 zeta) at w_c, where it is prewarped; 40 dB a decade above. It costs a phase of
about 2 zeta w / w_c rad at frequencies w well below w_c.

Source: thesis 12.7, the second-order low-pass of figure 12.9.
"""

from math import pi, sqrt
from typing import Literal

from rtctl.idiom import Settings, quantity
from rtctl.laws.biquad import BIQUAD_STATE, BiquadParams, bilinear2, reset, step

__all__ = ["BIQUAD_STATE", "BiquadParams", "LowPassSettings", "build", "reset", "step"]


class LowPassSettings(Settings):
    kind: Literal["low_pass"] = "low_pass"
    frequency: float = quantity(unit="Hz", gt=0, help="corner frequency")
    zeta: float = quantity(sqrt(0.5), unit="", gt=0, help="damping; 0.707 is the flattest (Butterworth)")


def build(settings: LowPassSettings, dt: float) -> BiquadParams:
    """Section for a tick of `dt` s. Raises ValueError where the corner is at or above the Nyquist frequency."""
    w_c = 2 * pi * settings.frequency
    return bilinear2([w_c**2], [1.0, 2 * settings.zeta * w_c, w_c**2], dt, prewarp=w_c)
