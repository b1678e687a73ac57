"""Compliance of a joint that is rigid in the nominal model: a spring between its two ends.

    T = c e + c tau e',   e = q_to - ratio q_from

The term has no force of its own: it makes the joint a spring of the description, so that the machine has one coordinate
more and the matrices hold the spring exactly, however stiff it is.

Source: Spong, Modeling and control of elastic joint robots, J. Dynamic Systems 109 (1987).
"""

from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Limit, Shape
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class ComplianceSettings(Settings):
    """Without effect while c is large; the size is 1 / c."""

    term: Literal["structure.compliance"] = "structure.compliance"
    node: Node
    c: float = quantity(unit="", gt=0, le=1e12, help="stiffness of the joint, in units of its far end")
    tau: float = quantity(1e-3, unit="s", ge=0, le=1.0, help="damping of the joint over its stiffness")


class ComplianceParams(NamedTuple):
    c: float


def build_compliance(settings: ComplianceSettings, h: float) -> ComplianceParams:
    """Nothing to discretise: the joint is part of the machine's matrices."""
    return ComplianceParams(settings.c)


def joint(settings: ComplianceSettings) -> dict[str, float]:
    """Stiffness and damping of the joint."""
    return {"stiffness": settings.c, "damping": settings.c * settings.tau}


COMPLIANCE = Term(
    name="structure.compliance",
    remedies=("joint", "notch"),
    words="a joint that should be rigid gives like a spring",
    equation="T = c (q_to - n q_from) + c tau (q_to' - n q_from')",
    source="Spong 1987",
    settings=ComplianceSettings,
    build=build_compliance,
    act={},
    joint=joint,
    stands=(stand("joint", "general rigid"),),
    look_alikes={
        "structure.resonance": "measure both ends: a compliant joint lets them move apart, an attached mass does not",
        "transmission.backlash": "small moves about the middle: a spring pushes back, a gap does not",
        "timing.delay": "a sweep: a delay leaves the gain as it is, a spring has a peak",
    },
    typical={"c": (1.0, 100.0)},
    scale={"c": "stiffness"},
    axis="frequency",
    order=75,
    since=2,
    phrase=Phrase(
        noun="a compliant joint",
        head="{here} yields like a spring",
        detail="it has a stiffness of {c}",
        need="quick changes of the command",
    ),
    check="Hold one end, load the other, and measure how far it yields; look for loose clamps and thin shafts.",
    units={"c": "stiffness"},
    search=(Limit("c", "firm", (1.0, 5.0, 25.0)), Shape("tau", "seconds", (1e-3,), 30.0)),
    draws={"c": Draw(1.0, 25.0, "stiffness")},
)
