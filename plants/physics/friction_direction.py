"""Dry friction that is larger one way than the other: a carriage that leans, a brush that bites, a seal with a lip.

It scales the limit of the dry friction that the node has so far, so that it can never push: at standstill it only
holds, more against one direction than against the other. In a physics list it stands after the terms whose friction
it scales. In motion one way and the other it equals symmetric friction beside a constant force of F_C a; the two
differ at standstill, where the force pushes and the friction does not.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994); Janot, Gautier & Brunot, Data set and
reference models of EMPS (2019), whose axis has it.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.physics.friction import DRY
from rtctl.plants.physics.term import Term


class AsymmetrySettings(Settings):
    """The sizes are a and B_a: with both zero it does nothing."""

    term: Literal["friction.asymmetry"] = "friction.asymmetry"
    node: str
    a: float = quantity(
        unit="", ge=-0.99, le=0.99, help="share by which dry friction is larger forwards and smaller backwards"
    )
    B_a: float = quantity(
        0.0, unit="", ge=-1e5, le=1e5, help="the same that grows with speed, Nms/rad or Ns/m by node; never below 0"
    )


ASYMMETRY_STATE = state(used=float, limit=float)


class AsymmetryParams(NamedTuple):
    a: float
    B_a: float


def build_asymmetry(settings: AsymmetrySettings, h: float) -> AsymmetryParams:
    """Nothing to discretise."""
    return AsymmetryParams(settings.a, settings.B_a)


@tick
def asymmetry(p, s, m, i, r):
    """Tilt the limit of dry friction of node `i`.

    The solver holds one limit over a substep. Where the last one turned within it, what the limit was wrong by before
    and after the turn is made good now, so that a reversal is right to second order.
    """
    v, way = m.x[m.r.shape[0] + i], direction(m, i)
    before = 3.0 * v - 2.0 * m.vm[i]  # from which the middle was extrapolated
    size = p.a * max(m.dry[i], 0.0)
    if v != 0.0 and v * before <= 0.0:  # it was friction of one size and either sign: its mean tells the turn
        after = min(max(0.5 - 0.5 * way * m.r[i] / s.limit, 0.0), 1.0) if s.limit > 0.0 else 1.0
        m.f[i] += way * ((-way * size - s.used) * (1.0 - after) - (way * size - s.used) * after)
    s.used = way * (size + r * r * p.B_a * (abs(m.vm[i]) if way != 0.0 else 0.0))
    m.dry[i] += s.used
    s.limit = m.dry[i]


@tick
def direction(m, i):
    """Which way node `i` slides or, where it stands, would slide: 1, -1, or 0 where nothing pushes it."""
    v = m.x[m.r.shape[0] + i]
    if v != 0.0:
        return math.copysign(1.0, v)
    if m.r[i] == 0.0:
        return 0.0
    return -math.copysign(1.0, m.r[i])  # what held it in the last substep points against the push


ASYMMETRY = Term(
    name="friction.asymmetry",
    words="it drags more one way than the other, and does not creep off by itself",
    equation="|F| <= F_C (1 + a sign(v)) + B_a v",
    source="Armstrong-Helouvry 1994; EMPS, Janot, Gautier & Brunot 2019",
    settings=AsymmetrySettings,
    build=build_asymmetry,
    act={"force": "friction_direction.asymmetry({p}, {s}, {m}, {i}, {r})"},
    nodes=DRY,
    look_alikes={
        "drive.offset": "let go at standstill and ramp both ways slowly: an offset shifts the break-away voltages, and "
        "a free axis that hardly sticks creeps off",
        "drive.gain_asymmetry": "the same speeds under two loads: the drive's error grows with the command",
        "load.spring": "move at several positions: a spring pushes by position, not by direction",
        "friction.coulomb": "one constant speed both ways: the difference of the two forces is the asymmetry",
    },
    typical={"a": (0.1, 0.3), "B_a": (0.02, 0.1)},
    scale={"B_a": "force/speed"},
    state=ASYMMETRY_STATE,
)
