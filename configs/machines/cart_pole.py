"""Cart-pole: a cart on a straight guide, and a pole that swings from it.

    M = [ M0 + m      m d cos a ]      h = [ -m d sin a q1'^2 ]
        [ m d cos a   J1 + m d^2]          [ m g d sin a      ]

q0 is the position of the cart; a = q1 is the angle of the pole, 0 where it hangs. M0 is the mass of the body `cart`, J1
the inertia of the body `pole` about its centre of mass.

Source: Tedrake, Underactuated Robotics (2023), 3.2. The description of the bodies gives the friction.
"""

import math
from typing import NamedTuple

from rtctl.idiom import Settings, quantity, tick

COORDINATES = ("cart", "pole")
G_N = 9.80665  # m/s^2


class CartPoleSettings(Settings):
    """Settings in the config, under `parameters`."""

    m: float = quantity(unit="kg", gt=0, help="mass of the pole")
    d: float = quantity(unit="m", gt=0, help="from the joint to the pole's centre of mass")


class CartPoleParams(NamedTuple):
    """Parameters of M and h."""

    m: float
    d: float


def build(settings: CartPoleSettings, h: float) -> CartPoleParams:
    """Parameters of M and h: nothing depends on the step `h`."""
    return CartPoleParams(settings.m, settings.d)


@tick
def M(p, J, q, out):
    """Mass matrix, kg, kg m and kg m^2."""
    out[0, 0] = J[0] + p.m
    out[0, 1] = p.m * p.d * math.cos(q[1])
    out[1, 0] = out[0, 1]
    out[1, 1] = J[1] + p.m * p.d**2


@tick
def h(p, J, q, v, out):
    """Centrifugal force on the cart, N, and gravity torque on the pole, Nm: M q'' + h = drives and friction."""
    out[0] = -p.m * p.d * math.sin(q[1]) * v[1] ** 2
    out[1] = p.m * G_N * p.d * math.sin(q[1])
