"""Angle-dependent inertia of a body, as of a crank or of an unbalanced linkage.

    d/dt ((J + D(q)) v) - D'(q) v^2 / 2 = torque,   D(q) = A cos(n q + phi)

J is the nominal inertia, which is the mean. All torques on the body act on J + D: a force corrects the acceleration of
the linear model with J, and the limit of dry friction is scaled. The kinetic energy is (J + D) v^2 / 2, which a free
turn conserves.

Source: Goldstein, Classical Mechanics (2002), 1.6; Waldron & Kinzel, Kinematics, Dynamics and Design of Machinery
(2004), ch. 14 for the inertia of slider-cranks.
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.element import stand
from rtctl.plants.physics.search import Choice, Turn
from rtctl.plants.physics.story import TURNS, Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term

SMALLEST = 0.05  # of the inertia: a body does not get lighter than this


class InertiaSettings(Settings):
    """A is the size."""

    term: Literal["load.inertia"] = "load.inertia"
    node: Node
    A: float = quantity(unit="", ge=-1e4, le=1e4, help="amplitude of the inertia about its mean, kg m^2 (kg)")
    phi: float = quantity(0.0, unit="rad", ge=-100, le=100, help="phase at angle 0")
    order: float = quantity(1.0, unit="", gt=0, le=100, help="periods in one turn; 2 for a crank")


class InertiaParams(NamedTuple):
    A: float
    phi: float
    n: float


def build_inertia(settings: InertiaSettings, h: float) -> InertiaParams:
    """Nothing to discretise."""
    return InertiaParams(settings.A, settings.phi, settings.order)


@tick
def gained(m, i):
    """Speed that node `i` gains in this substep by the linear model and the forces so far, rad/s or m/s."""
    nq, nu, at = m.nq, m.nu, m.nq + i
    v = -m.x[at]
    for k in range(m.nx):
        v += m.Phi_T[k, at] * m.x[k]
    for d in range(nu):
        v += m.Gamma_T[d, at] * m.u[d]
    for j in range(nq):
        v += m.Gamma_T[nu + j, at] * m.f[j]
    return v


@tick
def turned(p, m, i, r):
    """Apply all torques on node `i` to its inertia at its angle; `r` takes its rotation to the unit of A.

    In a substep J dv is the impulse of all forces, and J_0 dv this impulse and that of the correcting torque. This
    torque changes dv and the forces of stiff adjacent springs, so the torque is solved for implicitly.
    """
    J_0 = 1.0 / m.G[m.nq + i, m.nu + i]
    x = p.n * r * m.qm[i] + p.phi
    J = max(J_0 + r * r * p.A * math.cos(x), SMALLEST * J_0)
    slope = -r * r * r * p.n * p.A * math.sin(x)
    less = (J_0 - J) / m.h
    push = less * gained(m, i) - 0.5 * slope * m.vm[i] * m.vm[i]
    m.f[i] += push / (1.0 - less * m.Gamma_T[m.nu + i, m.nq + i])
    m.dry[i] *= J_0 / J


INERTIA = Term(
    name="load.inertia",
    remedies=("feedforward",),
    words="it is heavier to turn at some angles than at others, like a crank",
    equation="((J + D) v)' - D' v^2 / 2 = torque, D = A cos(n q + phi)",
    source="Goldstein 2002, 1.6; Waldron & Kinzel 2004, ch. 14",
    settings=InertiaSettings,
    build=build_inertia,
    act={"last": "load_inertia.turned({p}, {m}, {i}, {r})"},
    stands=(stand("body", "general turns single"),),
    look_alikes={
        "load.imbalance": "turn slowly, then fast: imbalance stays as it is, an inertia grows with the square of speed",
        "ripple.cogging": "turn slowly by hand: cogging is felt, an inertia is not",
        "ripple.torque": "turn fast with the power off: an inertia still makes the speed go up and down",
    },
    typical={"A": (0.05, 0.5)},
    scale={"A": "inertia"},
    axis="angle",
    order=126,
    since=2,
    phrase=Phrase(
        noun="uneven inertia",
        head="{here} is heavier to turn at some angles",
        detail="its inertia is up to {A} above and below its mean",
        need=f"{TURNS}, with strong acceleration",
    ),
    check="Look for a crank or a linkage behind it, and compare how fast it starts at several angles.",
    units={"A": "inertia"},
    needs=Needs(turns=0.25),
    search=(Turn("A", "phi", "inertia", 0.1), Choice("order", (1.0, 2.0))),
    stiff=True,
    draws={"A": Draw(0.1, 0.4, "inertia")},
    chosen={"order": (1.0, 2.0)},
)
