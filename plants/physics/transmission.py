"""Backlash in a coupling: a dead zone replaces the link's linear spring.

    T = c d(e) + k (damping + (1 - damping) d'(e)) e',   d = e beyond half the gap, less half the gap; 0 within

Beyond the gap the pull is that of the shifted linear spring and damper of the link. The first contact is softer than
the link (grease, a tip, an edge out of true), so that neither force nor its derivative jumps: the corners are
hyperbolas, which at the edge itself give half of `edge` of half the gap. At small pulls, as at a tape's tension, the
hyperbolas dominate. At rest the link is in the middle of its gap. The difference to the linear spring is a pull held
over the substep, under which free ends keep their relative speed: second order, for h times the link's own angular
frequency w = sqrt(c (a^2/J_i + b^2/J_j)) up to 1. The relative error of the travel across the gap is (w h)^2 / 12. The
axis has no spring between motor and carriage: its backlash is between carriage and sensor, and the reading follows
with the hysteresis of a gap.

Source: Nordin & Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38 (2002); Lurie & Enright,
Classical feedback control, for the play operator.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

FIRM = 25.0  # times the stiffness at which the lighter side rings slowly: stiffness of a nearly rigid joint
FIRM_TAU = 1e-3  # s, damping over stiffness of a nearly rigid joint


class BacklashSettings(Settings):
    """gap is the size."""

    term: Literal["transmission.backlash"] = "transmission.backlash"
    node: Node
    gap: float = quantity(unit="", ge=0, le=1.0, help="total backlash, rad of the link's first end (m at an axis)")
    damping: float = quantity(0.0, unit="", ge=0, le=1, help="share of the link's damping that also acts in the gap")
    edge: float = quantity(0.005, unit="", ge=0, le=1, help="share of half the gap by which its edges are rounded")
    c: float = quantity(
        0.0, unit="", ge=0, le=1e12, help="stiffness beyond the gap, of a joint that is described as rigid"
    )


class BacklashParams(NamedTuple):
    half: float
    damping: float
    edge: float


BACKLASH_STATE = state(at=float)  # position of the sensor of an axis


def build_backlash(settings: BacklashSettings, h: float) -> BacklashParams:
    """Half the gap; nothing to discretise."""
    return BacklashParams(max(0.5 * settings.gap, 0.0), settings.damping, settings.edge)


def joint(settings: BacklashSettings) -> dict[str, float]:
    """Stiffness and damping of a joint that is rigid in the nominal model."""
    return firm(settings.c)


def firm(c: float) -> dict[str, float]:
    """Stiffness and damping of a joint that is rigid except for an effect in it; empty for a `c` of 0."""
    return {"stiffness": c, "damping": c * FIRM_TAU} if c > 0.0 else {}


@tick
def backlash(p, m, j):
    """Pull to add to the linear spring of link `j`, Nm."""
    k = 1.0 + ahead(m, j)
    e0 = start(m, j)
    e = e0 + k * (linear.stretch(m, j) - e0)
    d, slope = dead_zone(e, p.half, p.edge)
    damper = (1.0 - p.damping) * (slope - 1.0)
    return m.link_c[j] * (d - e) + m.link_k[j] * damper * k * linear.stretch_rate(m, j)


@tick
def start(m, j):
    """Elongation of link `j` at the start of the substep, rad or m."""
    return m.link_a[j] * m.x[m.link_i[j]] + m.link_b[j] * m.x[m.link_j[j]]


@tick
def ahead(m, j):
    """Share beyond the middle of the substep of the point at which a pull cancels link `j` over the substep.

    The spring of the linear model continues to act about the point of the cancelling pull. The free ends keep their
    relative speed if this point lies tan(w h/2) / (w h/2) times as far ahead as the middle. At the middle itself the
    ends would lose (w h)^4 / 24 of their speed, which at the 2 kHz of the LDU's shaft is the force of a contact.
    """
    nq, nu = m.nq, m.nu
    a, b = m.link_a[j], m.link_b[j]
    mobility = a * a * m.G[nq + m.link_i[j], nu + m.link_i[j]] + b * b * m.G[nq + m.link_j[j], nu + m.link_j[j]]
    x = min(m.link_c[j] * mobility * m.h * m.h, 1.0)
    return x * (1.0 + 0.1 * x) / 12.0


@tick
def undone(m, j):
    """Pull that cancels link `j` over a substep, N or Nm."""
    way = linear.stretch(m, j) - start(m, j)
    more = m.link_c[j] * way + m.link_k[j] * linear.stretch_rate(m, j)
    return linear.tension(m, j) + ahead(m, j) * more


@tick
def dead_zone(e, half, edge):
    """Elongation beyond the dead zone -half .. half, and its slope; hyperbolas join the straight parts."""
    w = edge * half
    if w < 1e-12:
        out = max(abs(e) - half, 0.0)
        return (out if e > 0.0 else -out), (1.0 if abs(e) >= half else 0.0)
    a, b = e - half, e + half
    r, s = math.sqrt(a * a + w * w), math.sqrt(b * b + w * w)
    return e + 0.5 * (r - s), 1.0 + 0.5 * (a / r - b / s)


@tick
def follow(s, p, x):
    """Position of a sensor behind a gap, moved by the edges of the gap; repeated calls at one `x` agree."""
    s.at = min(max(s.at, x - p.half), x + p.half)
    return s.at


@tick
def play(p, s, m, i, r, j):
    """Backlash in link `j`, or, without a link, of the sensor of coordinate `i`, which moves `r` for a unit."""
    if j >= 0:
        linear.pull(m, j, backlash(p, m, j))
    else:
        follow(s, p, r * m.x[i])


@tick
def shown(p, s, y, j):
    """Reading of a sensor behind a gap for `y`; `y` itself where the backlash is in link `j`."""
    return y if j >= 0 else min(max(s.at, y - p.half), y + p.half)


BACKLASH = Term(
    name="transmission.backlash",
    remedies=("joint", "table"),
    words="play: on reversal the motor turns a little before anything follows",
    equation="T = c d(e), d = 0 for |e| < gap/2, e -+ gap/2 beyond",
    source="Nordin & Gutman 2002",
    settings=BacklashSettings,
    build=build_backlash,
    act={
        "force": "linear.pull({m}, {l}, transmission.backlash({p}, {m}, {l}))",
        "force:described": "transmission.play({p}, {s}, {m}, {i}, {r}, {l})",
        "reading:described": "{m}.y[{c}] = transmission.shown({p}, {s}, {m}.y[{c}], {l})",
        "force:axis": "transmission.follow({s}, {p}, {m}.x[{i}])",
        "reading:axis": "{m}.y[{c}] = min(max({s}.at, {m}.y[{c}] - {p}.half), {m}.y[{c}] + {p}.half)",
    },
    stands=(
        stand("joint", "shaft"),
        stand("sensor", "lone", usual=False),
        stand(
            "joint",
            "general rigid",
            usual=False,
            ways=((Size("gap", "span", (3e-4, 3e-3), finest=2.0), Choice("c", (FIRM,), "firm")),),
        ),
    ),
    look_alikes={
        "friction.presliding": "reverse with a small force: in a gap nothing pushes back, bristles do at once",
        "drive.deadband": "push both ways against a stop: a dead band does not depend on the side it came from",
        "friction.stribeck": "reverse at several speeds: the lost travel stays the same, the sticking time does not",
        "structure.stiffening": "load from zero to full: past the gap the stiffness is constant again",
    },
    typical={"gap": (2e-4, 4e-3)},
    axis="velocity",
    shown="to and fro",
    order=60,
    joint=joint,
    state=BACKLASH_STATE,
    phrase=Phrase(
        noun="backlash",
        head="{here} has play",
        detail="{gap} is lost on each reversal",
        need="reversals",
    ),
    check="Hold one side of the coupling and turn the other by hand; look at keys, set screws and gear teeth.",
    search=(
        Size("gap", "twist", (0.3, 5.0, 60.0), finest=2.0),
        Choice("damping", (0.0, 1.0)),
        Choice("edge", (0.005, 0.1)),
    ),
    richer=(Shape("edge", "one", (0.05,), 20.0),),
    variants=Choice("damping", (0.0, 1.0)),
    units={"c": "stiffness"},
    richer_at="joint",
    stiff=True,
    draws={"gap": Draw(1.0, 5.0, "twist")},
)
