"""Model feedforward: inverse dynamics along the reference, with every effect that was found.

    q = phi r,  v = phi r',  a = phi r''               reference motion of every coordinate, rigid
    F = f(q, v) - dry(q, v) sign(r') - D v - K q - M a         effects by their own laws, and the description
    u = -phi' F / g + k_v r'                           g: force along the motion for one unit of command
    shift = c C F                                      deflection between the feedback and the body behind springs

The reference is taken `lead` s ahead, the time until a command acts. Dry friction keeps the sign of the last motion at
rest and is compensated by a share below breakaway. k_v r' is the part of the command that a velocity feedback
subtracts. `behind` s is the delay of the sensor: the feedback gets the reference of `behind` s before.

Effects run their own compiled laws on a record of the machine (plants/linear.py) that moves along the reference: see
rtctl/machines/compensation.py for the lines.

Source: Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), 4.4; thesis 12.7 (computed torque).
"""

from typing import Any, NamedTuple

import numpy as np

from rtctl.idiom import state, tick
from rtctl.plants import linear
from rtctl.plants.graph import plant
from rtctl.plants.linear import MOST_BODIES


class ModelFeedforwardParams(NamedTuple):
    graph: Any  # GraphParams of the machine
    phi: np.ndarray  # (MOST_BODIES,) of each coordinate for one unit of the reference
    mass: np.ndarray  # M phi, share included
    viscous: np.ndarray  # D phi
    stiff: np.ndarray  # K phi
    dry: np.ndarray  # dry friction of the description, share included
    push: np.ndarray  # force at each coordinate for one unit of command
    plus: float  # g, for positive commands
    minus: float  # g, for negative commands
    lead: float  # s
    behind: float  # s
    k_v: float  # V s per unit
    shaped: int  # 1: speed and acceleration come from the shaper
    inputs: np.ndarray  # (MOST_DRIVES,) of each drive for one unit of command
    shift: np.ndarray  # c C, (MOST_BODIES,) unit per force
    bend: np.ndarray  # C, (MOST_BODIES, MOST_BODIES), deflection of each coordinate
    dt: float  # s


MODEL_FEEDFORWARD_STATE = state(
    m=linear.MACHINE, ref=float, v=float, direction=float, primed=int, u=float, known=float, shift=float,
    f=(float, MOST_BODIES), dry=(float, MOST_BODIES),
)  # fmt: skip  # `known` is the part of u against forces that are no inertia, V


@tick
def begin(p, s, ref, v, a):
    """Put the record onto the reference `ref` with speed `v` and acceleration `a`, without effects."""
    m = s.m
    if s.primed == 0:
        plant.prepare(p.graph, m)
        plant.assemble(p.graph, m)
        s.ref = ref
        s.primed = 1
        s.m.t = 0.0
    if p.shaped == 0:
        v = (ref - s.ref) / p.dt
        a = 0.0
    s.ref = ref
    s.v = v
    ahead = ref + p.lead * (v + 0.5 * p.lead * a)
    v += p.lead * a
    if v > 0.0:
        s.direction = 1.0
    elif v < 0.0:
        s.direction = -1.0
    m.h = p.dt
    m.t += p.dt
    for i in range(m.nq):
        bent = 0.0
        for j in range(m.nq):
            bent += p.bend[i, j] * s.f[j]
        m.qm[i] = p.phi[i] * ahead + bent
        m.vm[i] = p.phi[i] * v
        m.x[i] = m.qm[i]
        m.x[m.nq + i] = m.vm[i]
        m.f[i] = -p.viscous[i] * v - p.stiff[i] * ahead
        m.dry_base[i] = p.dry[i]
        m.dry[i] = p.dry[i]
    for j in range(m.nu):
        m.u[j] = p.inputs[j] * s.u
    for j in range(m.nl):
        m.link_T[j] = 0.0
        m.link_e[j] = 0.0
        m.link_v[j] = 0.0
    plant.weigh(p.graph, m)
    return a


@tick
def keep(s):
    """Remember the forces before an effect."""
    for i in range(s.m.nq):
        s.f[i] = s.m.f[i]
        s.dry[i] = s.m.dry[i]


@tick
def blend(s, share):
    """Take a share of what an effect has added since `keep`."""
    for i in range(s.m.nq):
        if share == 0.0:  # exact, whatever forces the effect has added
            s.m.f[i], s.m.dry[i] = s.f[i], s.dry[i]
        else:
            s.m.f[i] = s.f[i] + share * (s.m.f[i] - s.f[i])
            s.m.dry[i] = s.dry[i] + share * (s.m.dry[i] - s.dry[i])


@tick
def finish(p, s, a):
    """Command in V for the forces along the reference with acceleration `a`; leaves s.u, s.known and s.shift."""
    m = s.m
    static, inertia = 0.0, 0.0
    for i in range(m.nq):
        sign = s.direction if p.phi[i] > 0.0 else -s.direction
        F = m.f[i] - max(m.dry[i], 0.0) * sign
        static += p.phi[i] * F
        inertia -= p.phi[i] * p.mass[i] * a
        s.f[i] = F - p.mass[i] * a
    total = static + inertia
    g = p.minus if total > 0.0 else p.plus
    s.u = -total / g
    s.known = -static / g
    s.shift = 0.0
    for i in range(m.nq):
        s.f[i] += p.push[i] * s.u
        s.shift += p.shift[i] * s.f[i]
    s.shift -= p.behind * s.v
    return s.u + p.k_v * s.v


@tick
def reset(p, s):
    """Forget the reference and the state of the record."""
    s.primed = 0
    s.direction = 0.0
    s.shift = 0.0
    s.u = 0.0
    for i in range(MOST_BODIES):
        s.f[i] = 0.0
