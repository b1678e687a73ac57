"""Presliding: before it slides, a dry contact is a spring of bristles with hysteresis.

    w' = v / z_s (1 - sign(v) w),   F = -F_C (w + tau_s w'),   w in -1 .. 1

w is the deflection of the bristles over z_s, the travel after which they slide. tau_s = 0 is Dahl's model; LuGre's
bristle damping sigma_1 = F_C tau_s / z_s keeps the bristles from ringing, and its Stribeck part raises F_C near
standstill to F_C (1 + rise exp(-(v / v_s)^2)). The bristle stiffness is sigma_0 = F_C / z_s.

Presliding replaces the node's dry friction. F_C is the limit from the terms before it: in a physics list presliding
stands after the terms that add dry friction. With z_s = 0 the dry friction is unchanged, which is the limit of
z_s -> 0. w follows the travel exactly; the force is solved implicitly with the speed at its end, so that any stiffness
is stable: second order in h, with the damping of a backward step only where sigma_0 h^2 exceeds the mass.
Energy: F v + d/dt (F_C z_s w^2 / 2) = -F_C |v| w^2 - F_C tau_s v^2 (1 - |w|) / z_s or less, never positive.

Source: Dahl, A solid friction model, Aerospace TOR-0158 (1968); Canudas de Wit, Olsson, Astrom & Lischinsky, A new
model for control of systems with friction, IEEE TAC 40 (1995); thesis 12.6.
"""

import math
from typing import Literal, NamedTuple

from pydantic import Field

from rtctl.idiom import Settings, quantity, state, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Shape, Size
from rtctl.plants.physics.story import Draw, Phrase
from rtctl.plants.physics.term import Node, Term

NEWTON = 40  # Newton steps, at most: far from the root each is one unit of the exponent, near it quadratic
CLOSE = 1e-13  # of the speed: tolerance of convergence


class PreslidingSettings(Settings):
    """z_s is the size: at 0 the node has its plain dry friction."""

    term: Literal["friction.presliding"] = "friction.presliding"
    node: Node
    z_s: float = quantity(unit="", ge=0, le=1.0, help="travel on the bristles before sliding, rad or m by node")
    form: Literal["dahl", "lugre"] = Field(
        default="dahl", description="law of the bristles; lugre adds damping and a rise at standstill"
    )
    tau_s: float = quantity(3e-3, unit="s", ge=0, le=1.0, help="damping of the bristles over their stiffness; lugre")
    rise: float = quantity(0.0, unit="", ge=0, le=10, help="share by which breakaway exceeds sliding friction; lugre")
    v_s: float = quantity(1.0, unit="", gt=0, le=1e3, help="Stribeck speed of the rise, rad/s or m/s by node")


class PreslidingParams(NamedTuple):
    z_s: float
    tau_s: float
    rise: float
    v_s: float


PRESLIDING_STATE = state(w=float, q=float, F=float)


def build_presliding(settings: PreslidingSettings, h: float) -> PreslidingParams:
    """Nothing to discretise: the exact step depends on the speed."""
    lugre = settings.form == "lugre"
    return PreslidingParams(
        settings.z_s, settings.tau_s if lugre else 0.0, settings.rise if lugre else 0.0, settings.v_s
    )


@tick
def replace(p, s, m, i, r):
    """Replace the dry friction of node `i` by bristles; `r` takes its rotation to the unit of z_s."""
    nq, nu = m.nq, m.nu
    z = p.z_s / r
    s.w = bend(s.w, m.x[i] - s.q, z)
    s.q = m.x[i]
    if z <= 0.0:
        return
    F_C = max(m.dry[i], 0.0)
    if p.rise != 0.0:
        F_C *= 1.0 + p.rise * math.exp(-((r * m.vm[i] / p.v_s) ** 2))
    m.dry[i] = 0.0
    s.F = bristles(s.w, s.F, F_C, z, p.tau_s, m.x[nq + i], m.vm[i], m.Gamma_T[nu + i, nq + i], m.h)
    m.f[i] += s.F


@tick
def bend(w, way, z):
    """Deflection after `way` of travel in one direction; exact."""
    if way == 0.0:
        return w
    s = math.copysign(1.0, way)
    if z <= 0.0:
        return s
    return s + (w - s) * math.exp(-abs(way) / z)


@tick
def bristles(w, F_last, F_C, z, tau, v, vm, gain, h):
    """Force of bristles bent by `w` over the coming substep.

    The speed at the share theta of the substep is the predicted speed, corrected for the change of force:
    u = v + 2 theta (vm - v) + theta gain (F - F_last). F falls as u grows and is concave in |u|, so that Newton's
    method from the side of small |u| converges to the one root without overshoot. theta is a half for soft bristles.
    """
    k = F_C * gain * h / z  # (angular frequency on the bristles times h)^2
    theta = 0.5 + 0.5 * k / (4.0 + k)
    damp = tau / (theta * h)
    b = theta * gain * F_C * (1.0 + damp)
    aim = v + 2.0 * theta * (vm - v) + theta * gain * (F_C * damp * w - F_last)
    s = 1.0 if aim >= b * w else -1.0
    fall = b * (1.0 - s * w)
    y = max(0.0, s * aim - b)  # speed in direction s
    for _ in range(NEWTON):
        e = fall * math.exp(-y * theta * h / z)
        step = (s * aim - y - b + e) / (1.0 + e * theta * h / z)
        y += step
        if step <= CLOSE * y:
            break
    w_end = s - (s - w) * math.exp(-y * theta * h / z)
    return -F_C * (w_end + damp * (w_end - w))


PRESLIDING = Term(
    name="friction.presliding",
    remedies=("feedforward", "integral"),
    words="it gives like a spring before it slides, and springs back a little when let go",
    equation="F = -F_C (w + tau_s w'), w' = v (1 - sign(v) w) / z_s",
    source="Dahl 1968; Canudas de Wit et al. 1995; thesis 12.6",
    settings=PreslidingSettings,
    build=build_presliding,
    act={"force": "presliding.replace({p}, {s}, {m}, {i}, {r})"},
    stands=(stand("body", "dry"),),
    look_alikes={
        "friction.stribeck": "reverse by a tiny distance: dry friction stands still, bristles move as a spring",
        "transmission.backlash": "reverse with a small force: bristles push back at once, a gap does not",
        "tape.viscoelastic": "hold and wait: bristles stay where they are, a relaxing tape moves on",
        "timing.delay": "steps far below break-away: a delay does not let a stuck node move",
    },
    typical={"z_s": (0.01, 0.1)},
    scale={"z_s": "travel"},
    axis="position",
    order=140,
    state=PRESLIDING_STATE,
    phrase=Phrase(
        noun="a spring before breakaway",
        head="{here} moves like a spring before it breaks away",
        detail="the spring acts over {z_s}",
        need="standstills and slow reversals",
    ),
    check="Push lightly without moving it, let go and see whether it springs back; look at seals and wipers.",
    search=(Size("z_s", "span", 0.001, finest=2.0), Choice("form", ("dahl", "lugre"))),
    richer=(
        Size("rise", "one", 0.1, most=3.0),
        Shape("v_s", "speed", (0.1,), 50.0),
        Shape("tau_s", "seconds", (0.003,), 300.0),
        Choice("form", ("lugre",)),
    ),
    replaces="dry",
    draws={"z_s": Draw(0.002, 0.02, "travel")},
    chosen={"form": ("dahl", "lugre")},
)
