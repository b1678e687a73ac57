"""Hysteresis of a joint: a rate-independent part of its pull reverses with the direction of its deflection.

    T = F_h w,   dw/de = (1 - |w|^n sign(w e')) / z_h,   w in -1 .. 1

n = 1 is Dahl's law, n = 2 the law of Bouc and Wen with equal shares, whose loops have a rounder tip. Belts, harmonic
drives and cable joints lose energy by hysteresis and not by the rate of their deflection. Both laws follow the
deflection exactly, whatever the substep. Where w is zero the joint is stiffer by F_h / z_h. Energy: F_h w e' less the
rate of the energy stored in w is a loss for every deflection, since |w|^n only reduces the slope.

Source: Dahl, A solid friction model, Aerospace TOR-0158 (1968); Wen, Method for random vibration of hysteretic systems,
J. Engineering Mechanics 102 (1976); Tjahjowidodo, Al-Bender & Van Brussel, Theoretical modelling and experimental
identification of nonlinear torsional behaviour in harmonic drives, Mechatronics 23 (2013).
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.physics.presliding import bend
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

FORMS = ("dahl", "bouc_wen")
ONE = 1.0 - 1e-15  # deflection w of the law of Bouc and Wen that counts as saturated


class HysteresisSettings(Settings):
    """F_h is the size."""

    term: Literal["transmission.hysteresis"] = "transmission.hysteresis"
    node: Node
    F_h: float = quantity(unit="", ge=0, le=1e5, help="force that reverses with direction, N or Nm by joint")
    z_h: float = quantity(unit="", gt=0, le=10, help="deflection over which F_h reverses, m or rad by joint")
    form: Literal["dahl", "bouc_wen"] = Field(
        default="dahl", description="reversal: exponential, or rounder, like a hyperbolic tangent"
    )


class HysteresisParams(NamedTuple):
    F_h: float
    z_h: float
    form: int


HYSTERESIS_STATE = state(w=float, e=float)


def build_hysteresis(settings: HysteresisSettings, h: float) -> HysteresisParams:
    """Nothing to discretise; stable while h sqrt(F_h / z_h / mass) stays below one."""
    return HysteresisParams(settings.F_h, settings.z_h, FORMS.index(settings.form))


@tick
def bouc_wen(w, way, z):
    """Deflection w of the law of Bouc and Wen after `way` in one direction; exact."""
    if way == 0.0:
        return w
    s = math.copysign(1.0, way)
    x, u = abs(way) / z, s * w
    if u < 0.0:  # unloading: u' = 1 + u^2 until u is 0
        back = -math.atan(u)
        if x < back:
            return s * math.tan(x - back)
        x, u = x - back, 0.0
    return s * math.tanh(math.atanh(min(u, ONE)) + x)


@tick
def hysteresis(p, s, m, j):
    """Hysteretic pull of link `j`, in addition to its spring and damper, N or Nm."""
    e = linear.stretch(m, j)
    s.w = bend(s.w, e - s.e, p.z_h) if p.form == 0 else bouc_wen(s.w, e - s.e, p.z_h)
    s.e = e
    return p.F_h * s.w


HYSTERESIS = Term(
    name="transmission.hysteresis",
    remedies=("feedforward", "joint"),
    words="it gives and comes back another way: on reversal a part of the push is lost first, at any speed",
    equation="T = F_h w, w' = e' (1 - |w|^n sign(w e')) / z_h",
    source="Dahl 1968; Wen 1976; Tjahjowidodo et al. 2013",
    settings=HysteresisSettings,
    build=build_hysteresis,
    act={"force": "linear.pull({m}, {l}, hysteresis.hysteresis({p}, {s}, {m}, {l}))"},
    stands=(stand("joint", "general spring"),),
    look_alikes={
        "transmission.backlash": "reverse with a small force: in a gap nothing pushes back, a compliant joint does",
        "friction.coulomb": "hold the far side and push the near one: friction needs a motion of the body, the joint "
        "only its deflection",
        "structure.stiffening": "load and unload slowly: a nonlinear spring follows the same curve back",
        "tape.viscoelastic": "load and hold: a relaxing joint creeps on, one with hysteresis stays",
    },
    typical={"F_h": (0.05, 0.5), "z_h": (0.002, 0.02)},
    scale={"F_h": "force", "z_h": "travel"},
    axis="position",
    order=65,
    since=2,
    state=HYSTERESIS_STATE,
    phrase=Phrase(
        noun="hysteresis",
        head="{here} does not spring back along the same curve",
        detail="{F_h} reverses with direction, over a deflection of {z_h}",
        need="slow reversals under load",
    ),
    check="Block the far side, load the joint slowly by hand both ways and watch whether it comes back.",
    search=(Size("F_h", "force", 0.1), Shape("z_h", "twist", (0.05, 0.3, 3.0)), Choice("form", FORMS)),
    variants=Choice("form", FORMS),
    stiff=True,
    draws={"F_h": Draw(0.1, 0.5, "force"), "z_h": Draw(0.3, 3.0, "twist")},
    chosen={"form": FORMS},
)
