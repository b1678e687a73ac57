"""Plant of a described machine: springs, dampers and inertias as matrices, weight as a force, drives with their states.

    M q'' = - F_v q' - sum_links a (c e + k e') + sum_drives a F + weight + terms + dry friction,   e = a q_i + b q_j

Drives are those of drives.py; reels are in reel.py.
"""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from rtctl.idiom import state, tick
from rtctl.plants import linear
from rtctl.plants.graph import reel
from rtctl.plants.graph.drives import current, drive
from rtctl.plants.graph.params import ACCELERATION, POSITION, SPEED, TENSION, GraphParams
from rtctl.plants.graph.spring import spring

GRAPH_STATE = state(m=linear.MACHINE)


@tick
def start(p, s):
    """Matrices and dry friction; positions and speeds stay as they are (zero at first)."""
    m = s.m
    prepare(p, m)
    discretise(p, m)


@tick
def prepare(p, m):
    """Numbers of the machine into its record, without the matrices over a substep."""
    linear.size(m, p.nq, p.nx, p.nu, p.ny, p.nl)
    m.h = p.h
    for i in range(p.nq):
        m.dry_base[i] = p.dry[i]
        m.viscous[i] = p.viscous[i]
        m.inertia[i] = p.inertia[i]
    for c in range(p.ny):
        m.y_speed[c] = 1 if p.sensor_kind[c] == SPEED else 0
    for j in range(p.nl):
        linear.link(m, j, p.link_i[j], p.link_a[j], p.link_j[j], p.link_b[j], p.link_c[j], p.link_k[j])
    reel.start_reels(p, m)


@tick
def discretise(p, m):
    """Matrices at the present radii and inertias."""
    reel.linearise(p, m)
    assemble(p, m)
    linear.discretise_machine(m)


@tick
def assemble(p, m):
    """Fill A (nx, nx) and G = [commands | forces at the coordinates] (nx, nu + nq) of the record."""
    nq, A, G = p.nq, m.A, m.G
    for i in range(p.nx):
        for j in range(p.nx):
            A[i, j] = 0.0
        for j in range(p.nu + nq):
            G[i, j] = 0.0
    for i in range(nq):
        A[i, nq + i] = 1.0
        A[nq + i, nq + i] = -p.viscous[i] / m.inertia[i]
        G[nq + i, p.nu + i] = 1.0 / m.inertia[i]
    for k in range(p.nl):
        spring(A, m, m.link_i[k], m.link_a[k], m.link_j[k], m.link_b[k], m.link_c[k], m.link_k[k])
    for d in range(p.nu):
        drive(A, G, p, m, d)


@tick
def ask(p, m):
    """Commands within their limits, in m.volts, before the drives act on them."""
    for d in range(p.nu):
        m.volts[d] = min(max(m.volts[d], -p.drive_limit[d]), p.drive_limit[d])


@tick
def take(p, m):
    """Outputs of the drives within their limits, from m.volts to the inputs m.u."""
    for d in range(p.nu):
        m.u[d] = min(max(m.volts[d], -p.drive_top[d]), p.drive_top[d])


@tick
def weigh(p, m):
    """Nonlinear forces, added to m.f: weight of every body, and reels that wind."""
    for k in range(p.weights):
        m.weight[p.weight_i[k]] = 0.0
    for k in range(p.weights):
        i, a = p.weight_i[k], p.weight_a[k]
        force = p.weight_force[k]
        if p.weight_turns[k] != 0:
            force *= math.sin(a * m.qm[i] + p.weight_angle[k])
        m.f[i] -= a * force
        m.weight[i] -= a * force
    if p.winds != 0:
        if reel.grow(p, m):
            discretise(p, m)
        reel.wind(p, m)


@tick
def tension(m, j):
    """Pull in link `j` at the end of the substep, with the pull of terms at its middle, N or Nm."""
    i1, a, i2, b = m.link_i[j], m.link_a[j], m.link_j[j], m.link_b[j]
    e = a * m.x[i1] + b * m.x[i2] + m.link_e[j] + 0.5 * m.h * m.link_v[j]
    v = a * m.x[m.nq + i1] + b * m.x[m.nq + i2] + m.link_v[j]
    return m.link_c[j] * e + m.link_k[j] * v + m.link_T[j]


@tick
def read(p, m):
    """Reading of each sensor before quantisation, in SI units, into m.y."""
    nq = p.nq
    for c in range(p.ny):
        kind = p.sensor_kind[c]  # POSITION is 0, SPEED 1
        i, a, j, b = p.sensor_i[c], p.sensor_a[c], p.sensor_j[c], p.sensor_b[c]
        if kind <= SPEED:
            at = kind * nq
            m.y[c] = a * m.x[at + i] + b * m.x[at + j]
            m.y_rate[c] = a * m.x[nq + i] + b * m.x[nq + j] if kind == POSITION else 0.0
        elif kind == ACCELERATION:
            m.y[c] = a * linear.acceleration(m, i) + b * linear.acceleration(m, j)
        elif kind == TENSION:
            m.y[c] = tension(m, p.sensor_of[c])
        else:
            m.y[c] = current(p, m, p.sensor_of[c])


def state_space(p: GraphParams) -> tuple[np.ndarray, np.ndarray]:
    """A (nx, nx) and B (nx, nu), commands in, at the start, without weight and dry friction."""
    fields: Any = linear.MACHINE.fields or {}  # as plain arrays: those of a record are slow to reach from Python
    m = SimpleNamespace(
        **{name: np.zeros(kind.shape, kind.base) for name, (kind, *_) in fields.items() if name != "work"}
    )
    prepare.interpret(p, m)
    assemble.interpret(p, m)
    return m.A[: p.nx, : p.nx].copy(), m.G[: p.nx, : p.nu].copy()
