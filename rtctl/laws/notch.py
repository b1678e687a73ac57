"""Notch: takes the gain out of a narrow band around a resonance.

    H_n = (s^2 + 2 zeta_z w_n s + w_n^2) / (s^2 + 2 zeta_p w_n s + w_n^2)

The gain is 1 far from w_n and zeta_z / zeta_p at w_n; zeta_p sets the width. Prewarped at w_n, so the notch is exactly
at w_n at any sample rate.

Source: thesis 12.5.
Erratum: the text gives the gain at the notch as (1 + zeta_z) / (1 + zeta_p).
"""

from math import pi
from typing import Literal

from rtctl.idiom import Settings, quantity
from rtctl.laws.biquad import BIQUAD_STATE, BiquadParams, bilinear2, reset, step

__all__ = ["BIQUAD_STATE", "BiquadParams", "NotchSettings", "build", "reset", "step"]


class NotchSettings(Settings):
    kind: Literal["notch"] = "notch"
    frequency: float = quantity(unit="Hz", gt=0, help="centre of the notch")
    zeta_z: float = quantity(unit="", ge=0, help="damping of the zeros; zeta_z/zeta_p is the gain at the notch")
    zeta_p: float = quantity(unit="", gt=0, help="damping of the poles; the notch is about 2 zeta_p frequency wide")


def build(settings: NotchSettings, dt: float) -> BiquadParams:
    """Section for a tick of `dt` s. Raises ValueError above the Nyquist frequency or where it would raise the gain."""
    if settings.zeta_z >= settings.zeta_p:
        raise ValueError(
            f"zeta_z {settings.zeta_z:g} is not below zeta_p {settings.zeta_p:g}; the gain would rise at the notch"
        )
    w_n = 2 * pi * settings.frequency
    num = [1.0, 2 * settings.zeta_z * w_n, w_n**2]
    den = [1.0, 2 * settings.zeta_p * w_n, w_n**2]
    return bilinear2(num, den, dt, prewarp=w_n)
