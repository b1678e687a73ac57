"""Furuta pendulum: an arm that turns about a vertical axis, and a pendulum at its tip.

    M = [ J0 + m r^2 + J sin^2 a    m r d cos a ]      h = [ J sin(2a) q0' q1' - m r d sin a q1'^2   ]
        [ m r d cos a               J           ]          [ -J/2 sin(2a) q0'^2 + m g d sin a        ]

q0 is the angle of the arm; a = q1 is the angle of the pendulum, 0 where it hangs. J0 is the inertia of the arm and the
rotor about the arm's axis. J = J1 + m d^2 is the inertia of the pendulum about its joint; J1 is the inertia of the body
`pendulum` about its centre of mass.

Source: Cazzolato & Prime, On the dynamics of the Furuta pendulum, J. Control Science and Engineering (2011), eq. 33,
for a slender pendulum. The description of the bodies gives the friction.
"""

import math
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, tick

COORDINATES = ("arm", "pendulum")
G_N = 9.80665  # m/s^2


class FurutaSettings(Settings):
    """Settings in the config, under `parameters`."""

    m: float = quantity(unit="kg", gt=0, help="mass of the pendulum")
    r: float = quantity(unit="m", gt=0, help="from the arm's axis to the pendulum's joint")
    d: float = quantity(unit="m", gt=0, help="from the joint to the pendulum's centre of mass")


class FurutaParams(NamedTuple):
    """Parameters of M and h."""

    m: float
    r: float
    d: float


def build(settings: FurutaSettings, h: float) -> FurutaParams:
    """Parameters of M and h: nothing depends on the step `h`."""
    return FurutaParams(settings.m, settings.r, settings.d)


@tick
def M(p, J, q, out):
    """Mass matrix, kg m^2."""
    pendulum, s = J[1] + p.m * p.d**2, math.sin(q[1])
    out[0, 0] = J[0] + p.m * p.r**2 + pendulum * s * s
    out[0, 1] = p.m * p.r * p.d * math.cos(q[1])
    out[1, 0] = out[0, 1]
    out[1, 1] = pendulum


@tick
def h(p, J, q, v, out):
    """Coriolis, centrifugal and gravity torques, Nm: M q'' + h = drives and friction."""
    pendulum, s, s2 = J[1] + p.m * p.d**2, math.sin(q[1]), math.sin(2.0 * q[1])
    out[0] = pendulum * s2 * v[0] * v[1] - p.m * p.r * p.d * s * v[1] ** 2
    out[1] = -0.5 * pendulum * s2 * v[0] ** 2 + p.m * G_N * p.d * s
