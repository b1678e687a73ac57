"""Position-dependent loads at a node: a spring, a cable chain, an imbalance, a bump along the travel.

All loads except drags derive from a potential and are conservative.

Source: diagnosis of feed drives, Altintas et al., Machine tool feed drives, CIRP Annals 60 (2011); Dahl 1968 for the
chain's drag; thesis 11.2 for dirt on strip and capstan.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.presliding import bend
from rtctl.plants.physics.search import At, Choice, Rest, Size, Turn, Where
from rtctl.plants.physics.story import PASSES, TURNS, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term

HILL = math.sqrt(math.e)  # steepest slope of exp(-x^2 / 2) is 1 / HILL, at x = 1
FORMS = ("drag", "hill", "push")
PULL = (Size("k", "stiff", 0.2, signed=True), Rest("x0", "force", 0.3))


class SpringSettings(Settings):
    """k is the size."""

    term: Literal["load.spring"] = "load.spring"
    node: Node
    k: float = quantity(unit="", ge=-1e6, le=1e6, help="stiffness, N/m or Nm/rad by node; negative pushes away")
    x0: float = quantity(0.0, unit="", ge=-1e3, le=1e3, help="position of zero force, m or rad by node")
    bend: float = quantity(
        0.0, unit="", ge=-1e12, le=1e12, help="stiffening with distance from x0, 1/m^2 or 1/rad^2; negative softens"
    )


class SpringParams(NamedTuple):
    k: float
    x0: float
    bend: float


def build_spring(settings: SpringSettings, h: float) -> SpringParams:
    """Nothing to discretise; stable while h sqrt(k / mass) stays below one."""
    return SpringParams(settings.k, settings.x0, settings.bend)


@tick
def spring(p, x):
    """Force on the node at `x`, N or Nm: linear near its rest, far from it quadratic or limited.

    The two branches have one slope at a bend of 0.
    """
    d = x - p.x0
    if p.bend == 0.0:
        return -p.k * d
    root = math.sqrt(1.0 + abs(p.bend) * d * d)
    return -p.k * d * (root if p.bend > 0.0 else 1.0 / root)


class CableChainSettings(Settings):
    """k and F_h are the sizes."""

    term: Literal["load.cable_chain"] = "load.cable_chain"
    node: Node
    k: float = quantity(unit="", ge=0, le=1e6, help="stiffness of the chain's bend, N/m")
    x0: float = quantity(0.0, unit="", ge=-1e3, le=1e3, help="position of zero force, m")
    F_h: float = quantity(0.0, unit="", ge=0, le=1e4, help="friction of links and cables on each other, N")
    z_h: float = quantity(5e-3, unit="", gt=0, le=10.0, help="travel over which the friction reverses, m")


class CableChainParams(NamedTuple):
    k: float
    x0: float
    F_h: float
    z_h: float


CABLE_CHAIN_STATE = state(w=float, x=float)


def build_cable_chain(settings: CableChainSettings, h: float) -> CableChainParams:
    """Nothing to discretise; stable while h sqrt((k + F_h / z_h) / mass) stays below one."""
    return CableChainParams(settings.k, settings.x0, settings.F_h, settings.z_h)


@tick
def cable_chain(p, s, x):
    """Force on a carriage at `x`, N: a spring, and a drag that turns over z_h after a reversal."""
    s.w = bend(s.w, x - s.x, p.z_h)
    s.x = x
    return -p.k * (x - p.x0) - p.F_h * s.w


class ImbalanceSettings(Settings):
    """A is the size; A cos(phi) and A sin(phi) are the well-behaved pair for a fit."""

    term: Literal["load.imbalance"] = "load.imbalance"
    node: Node
    A: float = quantity(unit="", ge=-1e4, le=1e4, help="largest torque, Nm (N at an axis)")
    phi: float = quantity(0.0, unit="", ge=-10, le=10, help="angle of the torque at the start, rad")
    turn: float = quantity(
        2 * math.pi, unit="", gt=0, help="travel of one turn: 2 pi rad, or the pitch of a screw in m"
    )


class ImbalanceParams(NamedTuple):
    A: float
    phi: float
    per_unit: float


def build_imbalance(settings: ImbalanceSettings, h: float) -> ImbalanceParams:
    """Nothing to discretise."""
    return ImbalanceParams(settings.A, settings.phi, 2.0 * math.pi / settings.turn)


@tick
def imbalance(p, x):
    """Torque on the node at angle `x`."""
    return p.A * math.sin(p.per_unit * x + p.phi)


class BumpSettings(Settings):
    """F is the size.

    drag: dry friction of F in both directions (dirt, a tight spot of the rail); hill: a force backwards before `at` and
    forwards behind it (a rail joint, a magnet), F at its steepest; push: F forwards in both directions (a dip in the
    level).
    """

    term: Literal["load.bump"] = "load.bump"
    node: Node
    F: float = quantity(unit="", ge=-1e4, le=1e4, help="largest force, N or Nm by node")
    at: float = quantity(unit="", ge=-1e4, le=1e4, help="position of the middle, m or rad by node")
    width: float = quantity(unit="", gt=0, le=1e3, help="standard deviation of the bell, m or rad by node")
    form: Literal["drag", "hill", "push"] = Field(
        default="drag", description="direction of the force: against the motion, away from the middle, or forwards"
    )
    every_turn: bool = Field(default=False, description="of a node that turns: at this angle of each turn, not once")


class BumpParams(NamedTuple):
    F: float
    at: float
    width: float
    form: int
    turn: float  # 0 for a bump at one place only


def build_bump(settings: BumpSettings, h: float) -> BumpParams:
    """Nothing to discretise; a pass shorter than a substep is not seen, so keep width above h times the speed."""
    turn = 2.0 * math.pi if settings.every_turn else 0.0
    return BumpParams(settings.F, settings.at, settings.width, FORMS.index(settings.form), turn)


@tick
def bell(p, x):
    """Distance from the middle in widths, and the height of the bell there, 0 to 1."""
    d = x - p.at
    if p.turn > 0.0:
        d -= p.turn * math.floor(d / p.turn + 0.5)
    d /= p.width
    return d, math.exp(-0.5 * d * d)


@tick
def bump(p, m, i, r):
    """Add the bump to the force or to the dry friction of node `i`; `r` takes its rotation to the unit of F."""
    d, height = bell(p, r * m.qm[i])
    if p.form == 0:
        m.dry[i] += r * p.F * height
    elif p.form == 1:
        m.f[i] += r * p.F * HILL * d * height
    else:
        m.f[i] += r * p.F * height


SPRING = Term(
    name="load.spring",
    remedies=("feedforward",),
    words="something pulls it back like a spring: a cable chain, a hose, a tilted rail that bends",
    equation="F = -k (x - x0), times or by sqrt(1 + |bend| (x - x0)^2)",
    source="Altintas 2011",
    settings=SpringSettings,
    build=build_spring,
    act={"force": "{m}.f[{i}] += {r} * load.spring({p}, {r} * {m}.qm[{i}])"},
    stands=(
        stand("body", "general bounded", ways=(PULL, (*PULL, Size("bend", "per_span2", 4.0, signed=True)))),
        stand("body", "bounded"),
    ),
    look_alikes={
        "drive.offset": "the same short move at both ends of the travel: an offset is the same everywhere",
        "load.cable_chain": "approach one place from both sides slowly: a spring pulls the same, a chain does not",
        "structure.stiffening": "displacements of one, two and three: a spring pulls in proportion",
        "friction.asymmetry": "the same short move at both ends of the travel: friction is the same everywhere",
    },
    typical={"k": (0.2, 1.0)},
    scale={"k": "force/travel"},
    axis="position",
    order=120,
    phrase=Phrase(
        noun="a spring force",
        head="something pulls {here} like a spring",
        detail="{k} {k:back to|away from} one place",
        need="long moves",
    ),
    check=("Let go at several places and see where it moves to; look at hoses, cables and the level of the rail."),
    search=(Size("k", "stiff", 0.2, signed=True), Where("x0")),
    static=True,
)
CABLE_CHAIN = Term(
    name="load.cable_chain",
    remedies=("feedforward",),
    words="a cable chain: it pulls by position and drags behind on reversal",
    equation="F = -k (x - x0) - F_h w, w' = v (1 - sign(v) w) / z_h",
    source="Altintas 2011; Dahl 1968",
    settings=CableChainSettings,
    build=build_cable_chain,
    act={"force": "{m}.f[{i}] += {r} * load.cable_chain({p}, {s}, {r} * {m}.qm[{i}])"},
    stands=(stand("body", "bounded"),),
    look_alikes={
        "load.spring": "approach one place from both sides slowly: a spring pulls the same, a chain does not",
        "friction.presliding": "reverse in mid-travel: bristles reverse within a tiny way, a chain within a long one",
        "friction.coulomb": "reverse and look at the first part of the move: Coulomb friction reverses at once",
    },
    typical={"k": (0.2, 1.0), "F_h": (0.1, 0.5), "z_h": (0.01, 0.1)},
    scale={"k": "force/travel", "F_h": "force", "z_h": "travel"},
    axis="position",
    order=120,
    state=CABLE_CHAIN_STATE,
    phrase=Phrase(
        noun="a cable chain",
        head="a cable chain pulls {here}",
        detail="{k} by position and {F_h} of friction",
        need="long moves with reversals",
    ),
    check="Unhook the cable chain and repeat the move.",
)
IMBALANCE = Term(
    name="load.imbalance",
    remedies=("feedforward",),
    words="heavy on one side: once a turn it helps, once a turn it hinders",
    equation="F = A sin(theta + phi)",
    source="Altintas 2011",
    settings=ImbalanceSettings,
    build=build_imbalance,
    act={"force": "{m}.f[{i}] += {r} * load.imbalance({p}, {r} * {m}.qm[{i}])"},
    stands=(stand("body", "rotor turns"),),
    look_alikes={
        "ripple.cogging": "turn slowly by hand and count: imbalance comes once a turn, cogging many times",
        "ripple.reel": "the same turns at another tension: imbalance stays, an eccentric reel follows the tension",
        "ripple.encoder": "slow and fast turns: a reading error does not fade with the inertia, a force does",
        "load.bump": "one slow turn: imbalance is a sine over the whole turn, a bump is narrow",
    },
    typical={"A": (0.05, 0.3)},
    scale={"A": "force"},
    axis="angle",
    order=120,
    phrase=Phrase(
        noun="imbalance",
        head="{here} is heavy on one side",
        detail="{A} helps once and hinders once in each turn",
        need=TURNS,
    ),
    check=(
        "Turn it by hand to several angles, let go and see whether it always comes to rest with the same side down."
    ),
    units={"A": "force"},
    needs=Needs(
        turns=0.5,
    ),
    search=(Turn("A", "phi", "force", 0.1),),
    static=True,
    draws={"A": Draw(0.05, 0.3, "force"), "turn": Draw(1.0, 1.0, "turn")},
)
BUMP = Term(
    name="load.bump",
    remedies=("feedforward",),
    words="a tight spot: at one place it takes more force to pass",
    equation="|F| <= F exp(-((x - at)/width)^2 / 2) more",
    source="thesis 11.2; Altintas 2011",
    settings=BumpSettings,
    build=build_bump,
    act={"force": "load.bump({p}, {m}, {i}, {r})"},
    stands=(stand("body"),),
    look_alikes={
        "sensor.missed_counts": "pass the place ten times: a bump comes back to zero error, lost counts add up",
        "guide.thickness": "the same travel seen by both sensors: thickness shows as a difference, a bump in both",
        "load.imbalance": "one slow turn: a bump is narrow, imbalance a sine",
        "ripple.cogging": "several turns: a tight spot is at one place, cogging everywhere",
    },
    typical={"F": (0.2, 1.0), "width": (0.005, 0.05)},
    scale={"F": "force", "width": "travel"},
    axis="position",
    shown="past",
    order=120,
    state=None,
    phrase=Phrase(
        noun="a tight spot",
        head="{here} has a tight spot",
        detail="{F} {F:more|less} to pass at {at:3}, within {width}",
        need=PASSES,
    ),
    check="Move slowly by hand past the place and feel for it; look for dirt, a dent or a joint of the rail.",
    search=(
        Size("F", "force", 0.2, signed=True),
        At("at", "width", 8, 0.05, 0.012),
        Choice("form", ("drag", "hill", "push")),
    ),
    variants=Choice("form", ("drag", "hill", "push")),
    static=True,
    draws={"F": Draw(0.2, 1.0, "force"), "at": Draw(0.02, 0.08, "travel"), "width": Draw(0.01, 0.05, "travel")},
    chosen={"form": ("drag", "hill", "push")},
)
