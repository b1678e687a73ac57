"""Tension feedforward: the constant voltages that keep the tape taut.

    V_i = F_t R_i / (K_m amp_per_volt)

Both motors pull with the same tape force, so the tape stays where it is. After a start or a reset the force grows
in a straight line over `ramp`, so that arming does not jerk the tape.

Source: thesis 5.1; F_t = 0.1 N from the slip couplings, section 5.1.
"""

from typing import NamedTuple

from rtctl.idiom import quantity, state, tick
from rtctl.laws.drive import DriveSettings


class TensionSettings(DriveSettings):
    F_t: float = quantity(0.1, unit="N", ge=0, help="tape tension")
    ramp: float = quantity(0.2, unit="s", ge=0, help="time from slack to full tension after arming")


class TensionParams(NamedTuple):
    F_t: float  # N
    torque_per_volt: float  # Nm/V
    ramp: float  # share of the tension that is added each tick


TENSION_STATE = state(V1=float, V2=float, share=float)  # V, V, 0 slack to 1 full tension


def build(settings: TensionSettings, dt: float) -> TensionParams:
    """Coefficients for a tick of `dt` s."""
    ramp = 1.0 if settings.ramp <= dt else dt / settings.ramp
    return TensionParams(settings.F_t, settings.torque_per_volt, ramp)


@tick
def step(p, s, R1, R2):
    """Write s.V1 and s.V2, the tension voltages in V, for the reel radii `R1` and `R2` in m."""
    s.share = min(s.share + p.ramp, 1.0)
    s.V1 = s.share * p.F_t * R1 / p.torque_per_volt
    s.V2 = s.share * p.F_t * R2 / p.torque_per_volt


@tick
def reset(p, s):
    """Start again from slack."""
    s.share = 0.0
    s.V1 = 0.0
    s.V2 = 0.0
