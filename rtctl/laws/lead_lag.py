"""Lead-lag compensator: high gain at low frequencies, phase lead at the cross-over.

    H_l = k (alpha tau_I s + 1) / (tau_I s + 1) (beta tau_D s + 1) / (tau_D s + 1)

The gain is k at rest, k alpha between the lag and the lead, k alpha beta above. One second-order section,
discretised by the bilinear transform.

Source: thesis 12.4.
"""

from math import pi
from typing import Literal

import numpy as np

from rtctl.idiom import Settings, quantity
from rtctl.laws.biquad import BIQUAD_STATE, BiquadParams, bilinear2, check_below_nyquist, reset, step

__all__ = ["BIQUAD_STATE", "BiquadParams", "LeadLagSettings", "build", "reset", "step"]


class LeadLagSettings(Settings):
    kind: Literal["lead_lag"] = "lead_lag"
    k: float = quantity(unit="V/m", gt=0, help="gain at rest; a bare number is V per unit of error")
    alpha: float = quantity(unit="", gt=0, lt=1, help="lag ratio, below 1")
    tau_I: float = quantity(unit="s", gt=0, help="lag time; large, so that its pole is near the origin")
    beta: float = quantity(unit="", gt=1, help="lead ratio, above 1")
    tau_D: float = quantity(unit="s", gt=0, help="lead time; the lead ends at 1/tau_D rad/s")


def build(settings: LeadLagSettings, dt: float) -> BiquadParams:
    """Section for a tick of `dt` s. Raises ValueError where lag and lead overlap or the lead ends above Nyquist."""
    lag_zero, lead_zero = settings.alpha * settings.tau_I, settings.beta * settings.tau_D
    if lag_zero <= lead_zero:
        raise ValueError(
            f"the lag ends at {1 / (2 * pi * lag_zero):g} Hz, above the lead at {1 / (2 * pi * lead_zero):g} Hz; "
            "make alpha tau_I larger than beta tau_D"
        )
    check_below_nyquist(1 / settings.tau_D, dt)
    num = settings.k * np.polymul([lag_zero, 1.0], [lead_zero, 1.0])
    den = np.polymul([settings.tau_I, 1.0], [settings.tau_D, 1.0])
    return bilinear2(num, den, dt)
