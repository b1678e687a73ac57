"""Path length of a tape that is stiff in bending: the tape stands off its guides, and less so at a higher tension.

A strip of bending stiffness B under the tension T leaves a guide of radius r along an elastica of the length scale
lambda = sqrt(B / T). Around a guide of wrap angle alpha the strip is longer than a limp tape by

    excess = 2 (2 lambda (1 - cos(psi / 2)) - r (psi - sin psi)),  psi = min(alpha / 2, 2 arcsin(lambda / (2 r)))

psi is the angle that the free strip turns by on either side; where it is alpha / 2 the strip touches the guide at one
line, and excess = 4 lambda (1 - cos(alpha / 4)) goes with 1 / sqrt(T). A path with such guides is longer by

    longer = excess ((F_t / T)^power - 1),  power = 1/2

than at the reference tension F_t. The reading of a sensor behind the path is off by this length.

Source: thesis chapter 3 ("we need a certain force to bend the paper around the guidance rolls"); Love, A Treatise on
the Mathematical Theory of Elasticity (1944), ch. 19, elastica of a rod that is pulled straight at its far end.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.graph import plant
from rtctl.plants.physics.search import Choice, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term


class PathLengthSettings(Settings):
    """excess is the size."""

    term: Literal["tape.path_length"] = "tape.path_length"
    node: Node
    excess: float = quantity(unit="m", ge=-1, le=1, help="length beyond that of a limp tape at the tension F_t")
    F_t: float = quantity(0.1, unit="N", gt=0, le=1e4, help="tension at which the length was set")
    power: float = quantity(0.5, unit="", gt=0, le=4, help="exponent of the tension; 1/2 for small guides")
    least: float = quantity(0.005, unit="N", gt=0, le=1e4, help="tension below which the length is constant")


class PathLengthParams(NamedTuple):
    excess: float  # m
    F_t: float  # N
    power: float
    least: float  # N


def build_path_length(settings: PathLengthSettings, h: float) -> PathLengthParams:
    """Nothing to discretise: the length follows the tension at once."""
    return PathLengthParams(settings.excess, settings.F_t, settings.power, settings.least)


def excess(B: float, T: float, alpha: float, r: float = 0.0) -> float:
    """Length in m beyond that of a limp tape round a guide of radius `r` m that turns the strip by `alpha` rad.

    `B` is its bending stiffness in Nm^2 (E w t^3 / 12 of a strip of width w and thickness t), `T` its tension in N.
    """
    scale = math.sqrt(B / T)
    psi = 0.5 * alpha
    if scale < 2.0 * r:
        psi = min(psi, 2.0 * math.asin(scale / (2.0 * r)))
    return 2.0 * (2.0 * scale * (1.0 - math.cos(0.5 * psi)) - r * (psi - math.sin(psi)))


@tick
def longer(p, T):
    """Length in m beyond that at the tension F_t, at the tension `T` N."""
    return p.excess * ((p.F_t / max(T, p.least)) ** p.power - 1.0)


@tick
def shown(p, m, c, j, i):
    """Offset the reading of sensor `c`, which measures coordinate `i` through span `j`, by the length of the span."""
    at = m.link_b[j] if m.link_j[j] == i else m.link_a[j]  # positive where the coordinate pulls tape out of the span
    m.y[c] -= longer(p, plant.tension(m, j)) / at


PATH_LENGTH = Term(
    name="tape.path_length",
    remedies=("tension",),
    words="the path of the tape is longer where it is pulled less: the tape is stiff and stands off its guides",
    equation="y = x - excess ((F_t / T)^power - 1)",
    source="thesis chapter 3; Love 1944, ch. 19",
    settings=PathLengthSettings,
    build=build_path_length,
    act={"reading": "path_length.shown({p}, {m}, {c}, {l}, {i})"},
    stands=(stand("joint", "spring span path"),),
    look_alikes={
        "sensor.scale": "stand still and pull harder at the tape: the path gets shorter, a wrong scale shows nothing",
        "geometry.radius_change": "hold the tension while a reel fills: the path keeps its length, a reel grows",
        "transmission.creep": "stand still and pull harder, then let go: the path comes back at once, creep does not",
        "tape.viscoelastic": "pull harder and wait: the path shortens at once, a tape that relaxes changes slowly",
    },
    typical={"excess": (2e-3, 1e-2)},
    axis="tension",
    order=165,
    since=2,
    static=False,
    phrase=Phrase(
        noun="a tension-dependent path",
        head="{here} gets longer as its tension falls",
        detail="it is {excess} longer than a limp tape would be at {F_t}",
        need="changes of tension",
    ),
    check="Pull at the tape by hand at standstill and see whether the picture moves; look at guides of small radius.",
    units={"excess": "m", "F_t": "N", "least": "N"},
    search=(Size("excess", "one", 0.003), Choice("power", (0.5, 1.0))),
    draws={"excess": Draw(2e-3, 1e-2)},
)
