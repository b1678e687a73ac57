"""Dry friction that changes along the way: a bent rail, a bearing out of true, a stretch that is worn.

The limit of dry friction is larger by  slope x + A f(x), in one of three forms:

    wave  f = sin(2 pi x / length + phi)              a shaft or a bearing out of true, a wavy rail
    step  f = (1 + tanh(2 (x - at) / length)) / 2     another piece of rail, a seal from some place on
    spot  f = exp(-((x - at) / length)^2 / 2)         a stretch that is worn, or where a rail pinches

A sum of limits below zero counts as 0, so that friction stays passive.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), section 2.3 for friction by position;
Armstrong, Friction: experimental determination, modeling and compensation, ICRA (1988).
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Shape, Size, Turn
from rtctl.plants.physics.story import Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term

FORMS = ("wave", "step", "spot")


class PositionSettings(Settings):
    """A and slope are the sizes; negative values reduce the friction."""

    term: Literal["friction.position"] = "friction.position"
    node: Node
    A: float = quantity(unit="", ge=-1e4, le=1e4, help="amplitude of the change of dry friction, Nm or N by node")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at position 0")
    length: float = quantity(unit="", gt=0, le=1e3, help="length of a wave; width of a step or spot; rad or m by node")
    form: Literal["wave", "step", "spot"] = Field(default="wave", description="shape of the change")
    at: float = quantity(0.0, unit="", ge=-1e6, le=1e6, help="position of the step or the spot, rad or m by node")
    slope: float = quantity(0.0, unit="", ge=-1e6, le=1e6, help="growth of dry friction with position, N/m or Nm/rad")


class PositionParams(NamedTuple):
    A: float
    phi: float
    n: float  # rad/m, or 1
    slope: float
    form: int
    at: float
    length: float


def build_position(settings: PositionSettings, h: float) -> PositionParams:
    """Nothing to discretise."""
    s = settings
    return PositionParams(s.A, s.phi, 2.0 * math.pi / s.length, s.slope, FORMS.index(s.form), s.at, s.length)


@tick
def along(p, x):
    """Addition to the limit of dry friction at `x`, Nm or N."""
    if p.form == 0:
        return p.slope * x + p.A * math.sin(p.n * x + p.phi)
    r = (x - p.at) / p.length
    return p.slope * x + p.A * (0.5 + 0.5 * math.tanh(2.0 * r) if p.form == 1 else math.exp(-0.5 * r * r))


POSITION = Term(
    name="friction.position",
    remedies=("feedforward", "integral"),
    words="it rubs more at one end or in the middle of the way than elsewhere",
    equation="|F| <= F_C + slope x + A f(x), f a wave, a step or a spot of some length",
    source="Armstrong-Helouvry et al. 1994, 2.3",
    settings=PositionSettings,
    build=build_position,
    act={"force": "{m}.dry[{i}] += {r} * friction_position.along({p}, {r} * {m}.qm[{i}])"},
    stands=(stand("body", "general"),),
    look_alikes={
        "load.bump": "pass slowly over the whole travel: a tight spot is narrow, this friction changes gently",
        "load.spring": "there and back slowly: a spring helps in one direction, friction hinders in both",
        "friction.coulomb": "the same short move at several places: plain dry friction is the same everywhere",
        "friction.asymmetry": "the same short move at several places, both ways: an asymmetry is the same everywhere",
    },
    typical={"A": (0.1, 0.6), "length": (0.5, 2.0)},
    scale={"A": "force", "length": "travel"},
    axis="position",
    order=105,
    since=2,
    phrase=Phrase(
        noun="position-dependent friction",
        head="{here} rubs more at some places",
        detail="{A} {A:more|less}, over {length}",
        need="slow moves over the whole travel, in both directions",
    ),
    check="Pull slowly over the whole travel with a spring balance; look at the rail and at worn stretches.",
    units={"A": "force", "length": "position", "at": "position", "slope": "stiffness"},
    needs=Needs(dry=True),
    # A step beyond the travel, or a wide spot, is equivalent to constant dry friction: a search tries waves alone.
    search=(Turn("A", "phi", "force", 0.2), Shape("length", "span", (0.5, 1.2), 2.0)),
    richer=(Size("slope", "stiff", 0.1, signed=True),),
    static=True,
    draws={"A": Draw(0.1, 0.5, "force"), "length": Draw(0.5, 1.5, "travel")},
)
