"""Dry friction that changes along the way: a bent rail, a bearing out of true, a stretch that is worn.

The limit of dry friction is larger by  slope x + A sin(2 pi x / length + phi). Where a sum of limits is below zero it
counts as none, so that friction never pushes.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), section 2.3 for friction by position;
Armstrong, Friction: experimental determination, modeling and compensation, ICRA (1988).
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Shape, Size, Turn
from rtctl.plants.physics.story import Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term


class PositionSettings(Settings):
    """A and slope are the sizes."""

    term: Literal["friction.position"] = "friction.position"
    node: Node
    A: float = quantity(unit="", ge=-1e4, le=1e4, help="amplitude of dry friction along the way, Nm or N by node")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at position 0")
    length: float = quantity(unit="", gt=0, le=1e3, help="way over which it comes back, rad or m by node")
    slope: float = quantity(0.0, unit="", ge=-1e6, le=1e6, help="growth of dry friction along the way, N/m or Nm/rad")


class PositionParams(NamedTuple):
    A: float
    phi: float
    n: float  # rad/m, or 1
    slope: float


def build_position(settings: PositionSettings, h: float) -> PositionParams:
    """Nothing to discretise."""
    return PositionParams(settings.A, settings.phi, 2.0 * math.pi / settings.length, settings.slope)


@tick
def along(p, x):
    """Addition to the limit of dry friction at `x`, Nm or N."""
    return p.slope * x + p.A * math.sin(p.n * x + p.phi)


POSITION = Term(
    name="friction.position",
    remedies=("feedforward", "integral"),
    words="it rubs more at one end or in the middle of the way than elsewhere",
    equation="|F| <= F_C + slope x + A sin(2 pi x / length + phi)",
    source="Armstrong-Helouvry et al. 1994, 2.3",
    settings=PositionSettings,
    build=build_position,
    act={"force": "{m}.dry[{i}] += {r} * friction_position.along({p}, {r} * {m}.qm[{i}])"},
    stands=(stand("body", "general"),),
    look_alikes={
        "load.bump": "pass slowly over the whole way: a bump is narrow, friction along the way changes gently",
        "load.spring": "there and back slowly: a spring helps one way, friction hinders both",
        "friction.coulomb": "the same short move at several places: plain dry friction is the same everywhere",
        "friction.asymmetry": "the same short move at several places, both ways: an asymmetry does not ask where",
    },
    typical={"A": (0.1, 0.6), "length": (0.5, 2.0)},
    scale={"A": "force", "length": "travel"},
    axis="position",
    order=105,
    since=2,
    phrase=Phrase(
        noun="friction that changes along the way",
        head="{here} rubs more at some places",
        detail="by up to {A}, in waves of {length}",
        need="slow moves over the whole way, both directions",
    ),
    check="Pull slowly over the whole way with a spring balance; look at the rail and at worn stretches.",
    units={"A": "force", "length": "position", "slope": "stiffness"},
    needs=Needs(dry=True),
    search=(Turn("A", "phi", "force", 0.2), Shape("length", "span", (0.5, 1.2), 2.0)),
    richer=(Size("slope", "stiff", 0.1, signed=True),),
    static=True,
    draws={"A": Draw(0.1, 0.5, "force"), "length": Draw(0.5, 1.5, "travel")},
)
