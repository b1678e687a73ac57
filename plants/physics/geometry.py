"""Geometry: a reel whose radius and inertia follow the tape that it winds.

    R = R_0 + d q / 2 pi (4.3, 4.4),  l = integral of R dq,  J = J_0 + (pi/2) rho_h (R^4 - R_0^4) (4.1, 4.2)

plants/graph/reel.py models the radius with the nominal thickness, and updates its matrices. This term adds the change
of radius to the model of one reel, or with `other` of both, by forces alone. For a nominal thickness of 0 the two
methods agree to a few percent of the effect over nine turns; the error is largest for a nearly empty reel.

Source: thesis (4.1)-(4.8).
"""

import math
from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants import linear
from rtctl.plants.element import stand
from rtctl.plants.graph import reel
from rtctl.plants.physics.ripple_tape import tape_of
from rtctl.plants.physics.search import Choice, Size
from rtctl.plants.physics.story import Draw, Needs, Phrase
from rtctl.plants.physics.term import Node, Term

PAPER = 1700.0 * 0.037  # kg/m^2: density times width of the thesis's paper
SMALLEST = 0.05  # of the inertia: a reel does not get lighter than this


class RadiusChangeSettings(Settings):
    """d is the size."""

    term: Literal["geometry.radius_change"] = "geometry.radius_change"
    node: Node
    d: float = quantity(unit="m", ge=-0.02, le=0.02, help="growth of the radius in a turn: the thickness of the tape")
    rho_h: float = quantity(PAPER, unit="kg/m^2", ge=0, le=1e4, help="density times width of the tape, for the inertia")
    R_min: float = quantity(0.02, unit="m", gt=0, le=1, help="radius of the empty reel")
    other: float = quantity(0.0, unit="", ge=0, le=1, help="share of d at the other reel: 1 for the same tape")


class RadiusChangeParams(NamedTuple):
    grow: float  # m/rad
    other: float  # m/rad, growth of the other reel
    rho_h: float
    R_min: float


def build_radius_change(settings: RadiusChangeSettings, h: float) -> RadiusChangeParams:
    """Nothing to discretise."""
    grow = settings.d / (2.0 * math.pi)
    return RadiusChangeParams(grow, settings.other * grow, settings.rho_h, settings.R_min)


@tick
def radius(p, m, j, grow):
    """Radius of the reel of tape `j` at its angle, m."""
    R_0 = m.link_a[j]
    return max(R_0 + grow * m.qm[m.link_i[j]], min(p.R_min, R_0))


@tick
def wound(p, m, j, grow):
    """Extend the tape `j` by the difference of tape wound at the changed radius."""
    i = m.link_i[j]
    R_0, q = m.link_a[j], m.qm[i]
    way = reel.wound(q, R_0, grow, min(p.R_min, R_0)) - R_0 * q
    linear.extend(m, j, way, (radius(p, m, j, grow) - R_0) * m.vm[i])


@tick
def turned(p, m, j, grow):
    """Apply the tension of tape `j` at its reel's radius, and all torques on the reel to its inertia."""
    i = m.link_i[j]
    R_0, R = m.link_a[j], radius(p, m, j, grow)
    m.f[i] -= (R - R_0) * linear.tension(m, j)
    # The matrices divide every torque on the reel by the old inertia: a force corrects the acceleration.
    torque, c, k = m.f[i], 0.0, 0.0
    for n in range(m.nl):
        T = linear.known(m, n)
        if m.link_i[n] == i:
            torque -= m.link_a[n] * T
            c += m.link_a[n] ** 2 * m.link_c[n]
            k += m.link_a[n] ** 2 * m.link_k[n]
        if m.link_j[n] == i:
            torque -= m.link_b[n] * T
            c += m.link_b[n] ** 2 * m.link_c[n]
            k += m.link_b[n] ** 2 * m.link_k[n]
    nq, nu = m.nq, m.nu
    J_0 = 1.0 / m.G[nq + i, nu + i]
    J = max(J_0 + 0.5 * math.pi * p.rho_h * (R**4 - R_0**4), SMALLEST * J_0)
    change = J_0 / J - 1.0
    # A light reel follows its springs within a substep: the full force, held over a substep, would be unstable.
    m.f[i] += torque * change / (1.0 + abs(change) * m.h * (k + m.h * c) / J_0)


@tick
def wind(p, m, j, k):
    """Elongation by the radius of the reel of tape `j` and, with `other`, of the reel of tape `k`."""
    wound(p, m, j, p.grow)
    if p.other != 0.0 and k >= 0:
        wound(p, m, k, p.other)


@tick
def turn(p, m, j, k):
    """Lever and inertia of the reel of tape `j` and, with `other`, of the reel of tape `k`, after every other force."""
    turned(p, m, j, p.grow)
    if p.other != 0.0 and k >= 0:
        turned(p, m, k, p.other)


@tick
def wind_at(p, m, i):
    """`wind` of reel `i` of the IVU, whose tapes are the first two links."""
    j = tape_of(m, i)
    wind(p, m, j, 1 - j)


@tick
def turn_at(p, m, i):
    """`turn` of reel `i` of the IVU, whose tapes are the first two links."""
    j = tape_of(m, i)
    turn(p, m, j, 1 - j)


RADIUS_CHANGE = Term(
    name="geometry.radius_change",
    remedies=("feedforward",),
    words="the reel fills or empties: its radius and its inertia change as the tape moves",
    equation="R = R_0 + d q / 2 pi, J = J_0 + (pi/2) rho_h (R^4 - R_0^4)",
    source="thesis (4.1)-(4.8)",
    settings=RadiusChangeSettings,
    build=build_radius_change,
    act={
        "force": "geometry.wind_at({p}, {m}, {i})",
        "force:described": "geometry.wind({p}, {m}, {l}, {k})",
        "last": "geometry.turn_at({p}, {m}, {i})",
        "last:described": "geometry.turn({p}, {m}, {l}, {k})",
    },
    stands=(stand("body", "reel"),),
    look_alikes={
        "sensor.scale": "two turns and two more: a growing reel errs by the square of the way, a scale does not",
        "drive.thermal": "wind there and back slowly: a radius comes back with the tape, heat does not",
        "tape.viscoelastic": "hold the tape still under tension: a radius stays, relaxation goes on",
        "transmission.creep": "the same winding at two tensions: creep grows with the force, a radius does not",
        "load.spring": "the same short move at both ends of the travel: a spring pulls at rest, a radius does not",
    },
    typical={"d": (1e-4, 1e-3)},
    axis="position",
    shown="turn",
    order=50,
    phrase=Phrase(
        noun="a changing radius",
        head="{here} changes its radius",
        detail="by {d} in each turn",
        need="many turns",
    ),
    check="Measure the radius of the reel before and after, and look at how the tape lies on it.",
    needs=Needs(turns=0.25),
    search=(Size("d", "one", 0.0001, signed=True), Choice("other", (1.0, 0.0))),
    draws={"d": Draw(0.0001, 0.001)},
)
