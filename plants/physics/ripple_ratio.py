"""Ripple of a ratio: periodic transmission error of a joint, as of an eccentric pulley.

The elongation of the joint is longer by  A sin(n q + phi) + harmonics  in the angle q of one of its ends. Spring and
damper of the joint act on this elongation, and the joint pulls at the turning body with the lever A n cos(n q + phi).
Both follow from one potential, so that the work of the spring over a whole turn is 0. The error is zero where the
machine starts. A joint that is rigid in the nominal model becomes a spring of high stiffness.

Source: Tuttle & Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robotics and Automation
12 (1996); Smith, Gear noise and vibration (2003), ch. 2 for transmission error; ISO 230-2 for the lead of screws.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.ripple import TURN, harmonics
from rtctl.plants.physics.search import Choice, Hint, Part, Turn
from rtctl.plants.physics.story import TURNS, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term
from rtctl.plants.physics.transmission import FIRM, firm

ENDS = ("from", "to")

ERROR = Turn("A", "phi", "one", 1e-3)


def at_end(end: str) -> tuple[tuple[Part, ...], ...]:
    """Search over the turns of one end: once and twice a turn, and at the frequencies that the record suggests."""
    here = Choice("end", (end,))
    return ((ERROR, here, Choice("order", (1.0, 2.0))), (ERROR, here, Hint("order", f"order_{end}")))


NEAR, FAR = at_end("from"), at_end("to")
RIGID = tuple((*way, Choice("c", (FIRM,), "firm")) for way in NEAR)  # for a rigid joint, whose two ends give one law


class RatioSettings(Settings):
    """A, A2, A3 are the sizes: errors once, twice, three times in a turn (or `order` times as often)."""

    term: Literal["ripple.ratio"] = "ripple.ratio"
    node: Node
    A: float = quantity(unit="", ge=-10, le=10, help="amplitude, in the unit of the joint's elongation: rad or m")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    A2: float = quantity(0.0, unit="", ge=-10, le=10, help="amplitude of the second harmonic")
    phi2: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the second harmonic")
    A3: float = quantity(0.0, unit="", ge=-10, le=10, help="amplitude of the third harmonic")
    phi3: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase of the third harmonic")
    end: Literal["from", "to"] = Field(default="from", description="end of the joint by whose angle the error repeats")
    order: float = quantity(1.0, unit="", gt=0, le=1e4, help="periods in one turn; 2 for a harmonic drive, or teeth")
    turn: float = quantity(TURN, unit="", gt=0, le=1e3, help="travel of one turn: 2 pi, or a pitch in m of a slide")
    c: float = quantity(0.0, unit="", ge=0, le=1e12, help="stiffness of a joint that is described as rigid")


class RatioParams(NamedTuple):
    n: float  # periods a rad or m
    A: float
    phi: float
    A2: float
    phi2: float
    A3: float
    phi3: float
    zero: float  # error at position 0


def build_ratio(settings: RatioSettings, h: float) -> RatioParams:
    """Error at position 0, which the joint starts without."""
    s = settings
    zero = harmonics.py_func(0.0, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3)
    return RatioParams(s.order * TURN / s.turn, s.A, s.phi, s.A2, s.phi2, s.A3, s.phi3, zero)


def joint(settings: RatioSettings) -> dict[str, float]:
    """Stiffness and damping of a joint that is rigid in the nominal model."""
    return firm(settings.c)


@tick
def error(p, q):
    """Elongation beyond the ratio at position `q`, rad or m."""
    return harmonics(p.n * q, p.A, p.phi, p.A2, p.phi2, p.A3, p.phi3) - p.zero


@tick
def lever(p, q):
    """Slope of the error at position `q`."""
    x = p.n * q
    one, two = p.A * math.cos(x + p.phi), 2.0 * p.A2 * math.cos(2.0 * x + p.phi2)
    return p.n * (one + two + 3.0 * p.A3 * math.cos(3.0 * x + p.phi3))


@tick
def stretched(p, m, j, i, r):
    """Extend link `j` by its error at node `i` of the turning end; `r` takes the node to the unit of this end."""
    q = r * m.qm[i]
    linear.extend(m, j, error(p, q), lever(p, q) * r * m.vm[i])


@tick
def levered(p, m, j, i, r):
    """Torque of the total pull of link `j` at the lever of its error."""
    m.f[i] -= r * lever(p, r * m.qm[i]) * linear.tension(m, j)


RATIO = Term(
    name="ripple.ratio",
    remedies=("feedforward", "joint"),
    words="a pulley, gear or screw that is out of true: the far end runs ahead and behind once a turn",
    equation="e = q_b - n q_a + A sin(q + phi) + A2 sin(2 q + phi2) + A3 sin(3 q + phi3)",
    source="Tuttle & Seering 1996; Smith 2003, ch. 2",
    settings=RatioSettings,
    build=build_ratio,
    act={
        "force": "ripple_ratio.stretched({p}, {m}, {l}, {i}, {r})",
        "last": "ripple_ratio.levered({p}, {m}, {l}, {i}, {r})",
    },
    stands=(
        stand("joint", "general spring turning turned", ways=(*NEAR, *FAR)),
        stand("joint", "general spring turned", ways=FAR),
        stand("joint", "general spring", ways=NEAR),
        stand("joint", "general rigid", usual=False, ways=RIGID),
    ),
    look_alikes={
        "ripple.encoder": "sensors on both ends: a ratio moves the far end, a reading error only its own sensor",
        "ripple.cogging": "slow and fast turns: a ratio moves the far end as far at any low speed, a force fades",
        "load.imbalance": "lay the axis level: imbalance depends on gravity, a ratio does not",
        "ripple.torque": "turn by hand with the power off: a ratio is still there, a gain is not",
    },
    typical={"A": (1e-4, 1e-2)},
    axis="angle",
    order=45,
    joint=joint,
    since=2,
    phrase=Phrase(
        noun="an uneven ratio",
        head="{here} runs unevenly",
        detail="its far end is up to {A} ahead and behind{harmonics:words}",
        need=TURNS,
    ),
    check="Turn the near end slowly by hand through one turn and follow the far end with a dial gauge.",
    units={"A": "position", "A2": "position", "A3": "position", "c": "stiffness"},
    needs=Needs(turns=0.5),
    search=(ERROR, Choice("end", ENDS), Choice("order", (1.0, 2.0))),
    richer=(Turn("A2", "phi2", "one", 3e-4), Turn("A3", "phi3", "one", 3e-4)),
    stiff=True,
    draws={"A": Draw(3e-4, 1e-2, "lever")},
    chosen={"end": ENDS},
)
