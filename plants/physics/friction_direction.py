"""Dry friction that is larger one way than the other: a carriage that leans, a brush that bites, a seal with a lip.

Friction of F_C (1 + a) one way and F_C (1 - a) the other is equivalent to friction of F_C both ways and a constant
force of F_C a, in sliding and in holding. The term is implemented as this force, limited by dry and viscous friction of
the description, so that reversals stay exact. In a physics list the term stands after the terms whose friction it
scales. An offset of the drive differs from asymmetry only where dry friction changes, by speed, load or position.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994); Janot, Gautier & Brunot, Data set and
reference models of EMPS (2019), whose axis has it.
"""

from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Size
from rtctl.plants.physics.story import BOTH, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term


class AsymmetrySettings(Settings):
    """The sizes are a and B_a: with both zero it does nothing."""

    term: Literal["friction.asymmetry"] = "friction.asymmetry"
    node: Node
    a: float = quantity(
        unit="", ge=-0.99, le=0.99, help="share by which dry friction is larger forwards and smaller backwards"
    )
    B_a: float = quantity(
        0.0,
        unit="",
        ge=-1e5,
        le=1e5,
        help="viscous difference of the directions, Nms/rad or Ns/m; never below 0",
    )


class AsymmetryParams(NamedTuple):
    a: float
    B_a: float


def build_asymmetry(settings: AsymmetrySettings, h: float) -> AsymmetryParams:
    """Nothing to discretise."""
    return AsymmetryParams(settings.a, settings.B_a)


@tick
def asymmetry(p, v, dry, r, viscous):
    """Force beside symmetric friction, dry of limit `dry` and `viscous`, at speed `v` of the node; `r` takes its
    rotation to B_a's."""
    held = max(dry, 0.0)
    limit = held + viscous * abs(v)
    return -min(max(p.a * held + r * r * p.B_a * abs(v), -limit), limit)


ASYMMETRY = Term(
    name="friction.asymmetry",
    remedies=("feedforward", "integral"),
    words="it drags more one way than the other",
    equation="|F| <= F_C (1 + a sign(v)) + B_a v",
    source="Armstrong-Helouvry 1994; EMPS, Janot, Gautier & Brunot 2019",
    settings=AsymmetrySettings,
    build=build_asymmetry,
    act={"force": "{m}.f[{i}] += friction_direction.asymmetry({p}, {m}.vm[{i}], {m}.dry[{i}], {r}, {m}.viscous[{i}])"},
    stands=(stand("body", "dry"),),
    look_alikes={
        "drive.offset": "at two places or loads of different friction: asymmetry grows with it, an offset stays",
        "drive.gain_asymmetry": "the same speeds under two loads: the drive's error grows with the command",
        "load.spring": "move at several positions: a spring pushes by position, not by direction",
        "friction.coulomb": "one constant speed both ways: the difference of the two forces is the asymmetry",
    },
    typical={"a": (0.1, 0.3), "B_a": (0.02, 0.1)},
    order=130,
    scale={"B_a": "force/speed"},
    phrase=Phrase(
        noun="uneven friction",
        head="{here} drags more one way",
        detail="dry friction is {a:%} {a:larger|smaller} forwards and {a:%} {a:smaller|larger} backwards",
        need=BOTH,
    ),
    check=(
        "Pull slowly with a spring balance in one direction and then in the other; look at wipers, and at the level."
    ),
    needs=Needs(friction=True, both_ways=True),
    search=(Size("a", "one", 0.2, signed=True, least=-4.9, most=4.9), Size("B_a", "drag", 0.05, signed=True)),
    static=True,
    draws={"a": Draw(0.1, 0.3, signed=True), "B_a": Draw(0.0, 0.0)},
)
