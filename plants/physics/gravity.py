"""Gravity that the nominal model leaves out: a hanging arm, a slide on an incline.

The torque on an arm is periodic in one turn, so that a quarter of a turn determines the angle at which it hangs; the
force on a slide is constant. Both derive from the height of the mass.

Source: Craig, Introduction to Robotics (2005), 6.8; Altintas et al., Machine tool feed drives, CIRP Annals 60 (2011)
for vertical axes.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Size, Turn
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

FORMS = ("arm", "incline")


class GravitySettings(Settings):
    """A is the size; A cos(phi) and A sin(phi) are the well-behaved pair for the fit of an arm."""

    term: Literal["load.gravity"] = "load.gravity"
    node: Node
    A: float = quantity(unit="", ge=-1e5, le=1e5, help="weight times lever, Nm; on an incline the force backwards, N")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="angle of the arm to the vertical at angle 0")
    form: Literal["arm", "incline"] = Field(default="arm", description="an arm that turns, or a slide on an incline")


class GravityParams(NamedTuple):
    A: float
    phi: float
    form: int


def build_gravity(settings: GravitySettings, h: float) -> GravityParams:
    """Nothing to discretise; stable while h sqrt(A / inertia) stays below one."""
    return GravityParams(settings.A, settings.phi, FORMS.index(settings.form))


@tick
def gravity(p, q):
    """Torque on a node at angle `q` rad, Nm, or force on a slide, N."""
    return -p.A if p.form == 1 else -p.A * math.sin(q + p.phi)


GRAVITY = Term(
    name="load.gravity",
    remedies=("feedforward", "integral"),
    words="its weight pulls at it: an arm wants to hang down, a slide wants to run down",
    equation="tau = -A sin(q + phi), or F = -A",
    source="Craig 2005, 6.8",
    settings=GravitySettings,
    build=build_gravity,
    act={"force": "{m}.f[{i}] += {r} * gravity.gravity({p}, {r} * {m}.qm[{i}])"},
    stands=(stand("body", "general"),),
    look_alikes={
        "load.imbalance": "one law on a body that turns: gravity of an arm that hangs, imbalance of a wheel that goes "
        "round; look at the machine",
        "load.spring": "half a turn or more: a spring pulls in proportion, gravity goes over a top",
        "drive.offset": "the same short move at two places of the travel: an offset is the same everywhere; of a "
        "slide, let go with the power off: gravity still pulls",
        "ripple.cogging": "one slow turn: gravity comes once a turn, cogging many times",
    },
    typical={"A": (0.1, 1.0)},
    scale={"A": "force"},
    axis="angle",
    order=125,
    since=2,
    phrase=Phrase(
        noun="gravity",
        head="the weight of {here} pulls",
        detail="by up to {A}",
        need="moves through a quarter of a turn, or both directions of a slide",
    ),
    check="Let go with the power off at several places and watch where it moves to; look at its counterweight.",
    units={"A": "force"},
    search=(Turn("A", "phi", "force", 0.3),),
    sliding=(Size("A", "force", 0.2, signed=True), Choice("form", ("incline",))),
    static=True,
    seldom=3.0,
    round="load.imbalance",
    draws={"A": Draw(0.2, 1.0, "force")},
)
