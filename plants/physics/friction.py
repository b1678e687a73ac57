"""Friction at a node: dry (a reaction up to a limit), viscous (in proportion to speed), or quadratic in speed.

Quadratic drag has no name in the first exchange format: a search for that format tests it only so that viscous
friction is not reported in its place.

Dry terms add to the limit of the node's dry friction and the solver finds the force, so that a sticking node stands
still; a sum of limits below zero counts as 0. Viscous terms add a force. Sizes may be negative where the nominal model
has more friction than the machine: the sum must be passive.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, A survey of models, analysis tools and compensation methods for
the control of machines with friction, Automatica 30 (1994); thesis (8.3); Hoerner, Fluid-dynamic drag (1965).
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import BOTH, Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class CoulombSettings(Settings):
    """F_C is the size; negative where there is less dry friction than the base model has."""

    term: Literal["friction.coulomb"] = "friction.coulomb"
    node: Node
    F_C: float = quantity(unit="", ge=-1e4, le=1e4, help="dry friction on top of the base model's, Nm or N by node")


class CoulombParams(NamedTuple):
    F_C: float


def build_coulomb(settings: CoulombSettings, h: float) -> CoulombParams:
    """Nothing to discretise."""
    return CoulombParams(settings.F_C)


@tick
def coulomb(p):
    """Addition to the limit of dry friction, Nm or N."""
    return p.F_C


class ViscousSettings(Settings):
    """B is the size; negative, down to the nominal viscous friction, where the machine has less than nominal."""

    term: Literal["friction.viscous"] = "friction.viscous"
    node: Node
    B: float = quantity(
        unit="", ge=-1e5, le=1e5, help="viscous friction on top of the base model's, Nms/rad or Ns/m by node"
    )


class ViscousParams(NamedTuple):
    B: float


def build_viscous(settings: ViscousSettings, h: float) -> ViscousParams:
    """Nothing to discretise."""
    return ViscousParams(settings.B)


@tick
def viscous(p, v):
    """Force on the node at speed `v`, Nm or N."""
    return -p.B * v


class QuadraticSettings(Settings):
    """Q is the size."""

    term: Literal["friction.quadratic"] = "friction.quadratic"
    node: Node
    Q: float = quantity(unit="", ge=0, le=1e6, help="quadratic drag, Nms^2/rad^2 or Ns^2/m^2 by node")


class QuadraticParams(NamedTuple):
    Q: float


def build_quadratic(settings: QuadraticSettings, h: float) -> QuadraticParams:
    """Nothing to discretise."""
    return QuadraticParams(settings.Q)


@tick
def quadratic(p, v):
    """Force on the node at speed `v`, Nm or N."""
    return -p.Q * abs(v) * v


class StribeckSettings(Settings):
    """F_s is the friction at standstill; it falls to the base model's within a few v_s of speed (8.3).

    The size is F_s less the base model's dry friction: there it does nothing.
    """

    term: Literal["friction.stribeck"] = "friction.stribeck"
    node: Node
    F_s: float = quantity(
        unit="", ge=0, le=1e4, help="dry friction at standstill, without other terms, Nm or N by node"
    )
    v_s: float = quantity(unit="", gt=0, le=1e3, help="Stribeck speed, rad/s or m/s by node")
    form: Literal["gaussian", "exponential", "tustin"] = Field(
        default="gaussian", description="fall with speed: exp(-(v/v_s)^2), exp(-|v|/v_s), 1/(1 + |v|/v_s)"
    )


class StribeckParams(NamedTuple):
    F_s: float
    v_s: float
    form: int


FORMS = ("gaussian", "exponential", "tustin")


def build_stribeck(settings: StribeckSettings, h: float) -> StribeckParams:
    """Nothing to discretise."""
    return StribeckParams(settings.F_s, settings.v_s, FORMS.index(settings.form))


@tick
def stribeck(p, F_C, v):
    """Addition to the limit of dry friction at speed `v` over a base of `F_C`, Nm or N.

    gaussian exp(-(v/v_s)^2) as in (8.3); exponential exp(-|v|/v_s), Bo & Pavelescu 1982; tustin 1/(1+(v/v_s)^2),
    Hess & Soom 1990.
    """
    z = abs(v) / p.v_s
    if p.form == 0:
        fall = math.exp(-z * z)
    elif p.form == 1:
        fall = math.exp(-z)
    else:
        fall = 1.0 / (1.0 + z * z)
    return (p.F_s - F_C) * fall


COULOMB = Term(
    name="friction.coulomb",
    remedies=("feedforward", "integral"),
    words="dry friction: it takes a fixed force to move, whatever the speed",
    equation="|F| <= F_C at rest, F = -F_C sign(v) in motion",
    source="Coulomb 1785; Armstrong-Helouvry 1994",
    settings=CoulombSettings,
    build=build_coulomb,
    act={"force": "{m}.dry[{i}] += {r} * friction.coulomb({p})"},
    stands=(stand("body"),),
    look_alikes={
        "friction.stribeck": "constant speeds from crawl to full: only Stribeck falls at the start",
        "friction.load": "the same motion at three tensions: only load friction grows",
        "drive.deadband": "push slowly both ways at standstill under a spring: the dead band shows in u, not in force",
    },
    typical={"F_C": (0.3, 1.0)},
    order=100,
    scale={"F_C": "dry"},
    phrase=Phrase(
        noun="dry friction",
        head="{here} rubs",
        detail="{F_added} {F_added:more|less} dry friction than in the model, at any speed",
        need=BOTH,
    ),
    check="Pull slowly with a spring balance in both directions; look at bearings, wipers and seals.",
    search=(Size("F_C", "force", 0.1, signed=True, undoes="dry", slight=0.1),),
    static=True,
    friction="dry",
    draws={"F_C": Draw(0.4, 1.0, "dry")},
)
VISCOUS = Term(
    name="friction.viscous",
    remedies=("feedforward",),
    words="viscous friction: a brake that grows in proportion to speed, as of grease or eddy currents",
    equation="F = -B v",
    source="Armstrong-Helouvry 1994",
    settings=ViscousSettings,
    build=build_viscous,
    act={"force": "{m}.f[{i}] += {r} * friction.viscous({p}, {r} * {m}.vm[{i}])"},
    stands=(stand("body"),),
    look_alikes={
        "friction.coulomb": "constant speeds over a decade: only viscous friction grows with speed",
        "drive.supply_sag": "load the other motor at constant speed: sag changes the gain, viscous friction does not",
    },
    typical={"B": (0.1, 0.5)},
    order=100,
    scale={"B": "force/speed"},
    phrase=Phrase(
        noun="viscous friction",
        head="{here} drags with speed",
        detail="{B} {B:more|less} viscous friction than in the model",
        need="moves at several speeds",
    ),
    check="Let it run out from several speeds; look at the grease, its amount and its temperature.",
    search=(Size("B", "drag", 0.1, signed=True, undoes="thick"),),
    static=True,
    friction="viscous",
)
QUADRATIC = Term(
    name="friction.quadratic",
    remedies=("feedforward",),
    words="drag by the square of speed, as of a fan or of churned oil",
    equation="F = -Q |v| v",
    source="Hoerner 1965",
    settings=QuadraticSettings,
    build=build_quadratic,
    act={"force": "{m}.f[{i}] += {r} * friction.quadratic({p}, {r} * {m}.vm[{i}])"},
    stands=(stand("body", "general"), stand("body", offered=False)),
    look_alikes={
        "friction.viscous": "constant speeds over a decade: viscous friction only doubles with speed",
        "friction.stribeck": "constant speeds from crawl to full: sticking falls at the start, this drag grows",
    },
    typical={"Q": (0.2, 1.0)},
    order=100,
    scale={"Q": "force/speed^2"},
    since=2,
    phrase=Phrase(
        noun="quadratic drag",
        head="{here} drags with the square of its speed",
        detail="its coefficient is {Q}",
        need="moves at several speeds",
    ),
    check="Look for a fan, a cover or an open wheel that moves air or oil.",
    search=(Size("Q", "drag2", 0.1),),
    static=True,
)
STRIBECK = Term(
    name="friction.stribeck",
    remedies=("feedforward", "integral"),
    words="sticking: it takes more to start moving than to keep moving",
    equation="F = (F_C + (F_s - F_C) exp(-(v/v_s)^2)) sign(v)",
    source="thesis (8.3); Bo & Pavelescu 1982; Hess & Soom 1990",
    settings=StribeckSettings,
    build=build_stribeck,
    act={"force": "{m}.dry[{i}] += {r} * friction.stribeck({p}, {m}.dry_base[{i}] / {r}, {r} * {m}.vm[{i}])"},
    stands=(stand("body"),),
    look_alikes={
        "friction.presliding": "reverse by a tiny distance: a spring with hysteresis is presliding",
        "friction.coulomb": "constant speeds from crawl to full: Coulomb stays flat",
        "friction.load": "break away at three tensions: sticking is there without any tension",
        "drive.deadband": "break away against a spring: sticking shows in force, the dead band in the command only",
    },
    typical={"F_s": (1.1, 2.0), "v_s": (0.02, 0.3)},
    order=100,
    scale={"F_s": "dry", "v_s": "speed"},
    phrase=Phrase(
        noun="sticking",
        head="{here} sticks",
        detail="{sticking:words}",
        need="standstills and slow moves",
    ),
    check=(
        "Pull slowly with a spring balance and compare the force that starts it and the force that "
        "keeps it moving; look at the lubrication."
    ),
    search=(Size("F_s", "force", 0.1, offset="dry"), Shape("v_s", "speed", (0.012, 0.035, 0.1, 0.3, 0.9), 4.0)),
    variants=Choice("form", ("gaussian", "exponential", "tustin")),
    static=True,
    falls_to="dry",
    chosen={"form": ("gaussian", "exponential", "tustin")},
)
