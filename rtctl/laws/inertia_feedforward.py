"""Inertia feedforward: each motor accelerates its own reel, so that the tape need not.

    u1 += share J R_c a / (R1 K_m amp_per_volt)        u2 -= share J R_c a / (R2 K_m amp_per_volt)

`a` is the acceleration of the capstan's reference. Without this feedforward the winding motor accelerates the other
reel through the tape, whose tension swings by the inertia force; with it the tension stays at the value of the
tension law.

Source: the computed torque of thesis 12.7 (figure 12.10), from (4.9)-(4.13) with tape and shafts taken as rigid.
"""

from typing import NamedTuple

from rtctl.idiom import quantity, state, tick
from rtctl.laws.drive import DriveSettings


class InertiaFeedforwardSettings(DriveSettings):
    share: float = quantity(0.9, unit="", ge=0, le=1, help="part of the inertia that is fed forward; 0 switches it off")
    J: float = quantity(1.6e-3, unit="kg*m^2", gt=0, help="inertia of a motor with its reel")
    R_c: float = quantity(1.25e-2, unit="m", gt=0, help="radius of the capstan")


class InertiaFeedforwardParams(NamedTuple):
    volts: float  # V per rad/s^2 of the capstan, at a reel of 1 m


INERTIA_FEEDFORWARD_STATE = state(u1=float, u2=float)


def build(settings: InertiaFeedforwardSettings, dt: float) -> InertiaFeedforwardParams:
    """Nothing to discretise: the law has no memory."""
    return InertiaFeedforwardParams(settings.share * settings.J * settings.R_c / settings.torque_per_volt)


@tick
def step(p, s, a, R1, R2):
    """Write s.u1 and s.u2, V to add to the motors, for `a` in rad/s^2 and the reel radii in m."""
    s.u1 = p.volts * a / R1
    s.u2 = -p.volts * a / R2
