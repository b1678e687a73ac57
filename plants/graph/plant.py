"""Plant of a described machine: springs, dampers and inertias as matrices, weight as a force, drives with their states.

    M q'' = - F_v q' - sum_links a (c e + k e') + sum_drives a F + weight + terms + dry friction,   e = a q_i + b q_j

A drive's command u passes its limit and a second-order low pass; then it is a force F = gain u, a current
F = K gain u, or a voltage: L I' = gain u - R I - K e', F = K I (L = 0: I follows at once).

Source: Spong, Hutchinson & Vidyasagar, Robot Modeling and Control (2006), ch. 6 for drives.
"""

import math

import numpy as np

from rtctl.idiom import state, tick
from rtctl.plants import linear
from rtctl.plants.graph.params import (
    ACCELERATION,
    CURRENT,
    POSITION,
    SPEED,
    TENSION,
    VOLTAGE,
    GraphParams,
)

GRAPH_STATE = state(m=linear.MACHINE)


@tick
def start(p, s):
    """Matrices and dry friction; positions and speeds stay as they are (zero at first)."""
    m = s.m
    linear.size(m, p.nq, p.nx, p.nu, p.ny, p.nl)
    m.h = p.h
    for i in range(p.nq):
        m.dry_base[i] = p.dry[i]
    assemble(p, m.A, m.G)
    linear.discretise_machine(m)
    for j in range(p.nl):
        linear.link(m, j, p.link_i[j], p.link_a[j], p.link_j[j], p.link_b[j], p.link_c[j], p.link_k[j])


@tick
def assemble(p, A, G):
    """Fill A (nx, nx) and G = [commands | forces at the coordinates] (nx, nu + nq)."""
    nq = p.nq
    for i in range(p.nx):
        for j in range(p.nx):
            A[i, j] = 0.0
        for j in range(p.nu + nq):
            G[i, j] = 0.0
    for i in range(nq):
        A[i, nq + i] = 1.0
        A[nq + i, nq + i] = -p.viscous[i] / p.inertia[i]
        G[nq + i, p.nu + i] = 1.0 / p.inertia[i]
    for k in range(p.nl):
        damper(A, p, p.link_i[k], p.link_a[k], p.link_j[k], p.link_b[k], p.link_c[k], p.link_k[k])
    for d in range(p.nu):
        drive(A, G, p, d)


@tick
def damper(A, p, i, a, j, b, c, k):
    """Spring c and damper k of elongation a q_i + b q_j."""
    nq = p.nq
    wi, wj = 1.0 / p.inertia[i], 1.0 / p.inertia[j]
    A[nq + i, i] -= wi * a * a * c
    A[nq + i, j] -= wi * a * b * c
    A[nq + j, i] -= wj * b * a * c
    A[nq + j, j] -= wj * b * b * c
    A[nq + i, nq + i] -= wi * a * a * k
    A[nq + i, nq + j] -= wi * a * b * k
    A[nq + j, nq + i] -= wj * b * a * k
    A[nq + j, nq + j] -= wj * b * b * k


@tick
def drive(A, G, p, d):
    """States of drive `d`, and the force that it puts on its coordinates."""
    nq, at = p.nq, p.drive_at[d]
    i, a, j, b = p.drive_i[d], p.drive_a[d], p.drive_j[d], p.drive_b[d]
    kind, K, w = p.drive_kind[d], p.drive_K[d], p.drive_w[d]
    wi, wj = a / p.inertia[i], b / p.inertia[j]
    made = -1  # state that holds what the low pass gives, in N, A or V
    if w > 0.0:  # x' = w z, z' = w (gain u - x) - 2 zeta w z
        A[at, at + 1] = w
        A[at + 1, at] = -w
        A[at + 1, at + 1] = -2.0 * p.drive_zeta[d] * w
        G[at + 1, d] = w * p.drive_gain[d]
        made, at = at, at + 2
    if kind == VOLTAGE and p.drive_L[d] > 0.0:
        L = p.drive_L[d]
        A[at, at] = -p.drive_R[d] / L
        A[at, nq + i] -= K * a / L
        A[at, nq + j] -= K * b / L
        if made >= 0:
            A[at, made] = 1.0 / L
        else:
            G[at, d] = p.drive_gain[d] / L
        A[nq + i, at] += wi * K
        A[nq + j, at] += wj * K
        return
    factor = K / p.drive_R[d] if kind == VOLTAGE else K if kind == CURRENT else 1.0
    if kind == VOLTAGE:
        damper(A, p, i, a, j, b, 0.0, K * factor)
    if made >= 0:
        A[nq + i, made] += wi * factor
        A[nq + j, made] += wj * factor
    else:
        G[nq + i, d] += wi * factor * p.drive_gain[d]
        G[nq + j, d] += wj * factor * p.drive_gain[d]


@tick
def take(p, m):
    """Commands within their limits, from m.volts to the inputs m.u."""
    for d in range(p.nu):
        m.u[d] = min(max(m.volts[d], -p.drive_limit[d]), p.drive_limit[d])


@tick
def weigh(p, m):
    """Weight of every body, on top of the forces m.f."""
    for k in range(p.weights):
        i, a = p.weight_i[k], p.weight_a[k]
        force = p.weight_force[k]
        if p.weight_turns[k] != 0:
            force *= math.sin(a * m.qm[i] + p.weight_angle[k])
        m.f[i] -= a * force


@tick
def current(p, m, d):
    """Current of drive `d`, A; of a force drive what it would be at a torque constant of 1."""
    nq, at, w = p.nq, p.drive_at[d], p.drive_w[d]
    given = m.x[at] if w > 0.0 else p.drive_gain[d] * m.u[d]
    if p.drive_kind[d] != VOLTAGE:
        return given
    if p.drive_L[d] > 0.0:
        return m.x[at + 2] if w > 0.0 else m.x[at]
    speed = p.drive_a[d] * m.x[nq + p.drive_i[d]] + p.drive_b[d] * m.x[nq + p.drive_j[d]]
    return (given - p.drive_K[d] * speed) / p.drive_R[d]


@tick
def tension(m, j):
    """Pull in link `j` at the end of the substep, with what terms added to it at its middle, N or Nm."""
    i1, a, i2, b = m.link_i[j], m.link_a[j], m.link_j[j], m.link_b[j]
    e = a * m.x[i1] + b * m.x[i2] + m.link_e[j]
    v = a * m.x[m.nq + i1] + b * m.x[m.nq + i2] + m.link_v[j]
    return m.link_c[j] * e + m.link_k[j] * v + m.link_T[j]


@tick
def read(p, m):
    """What each sensor would show, in SI units, into m.y."""
    nq = p.nq
    for c in range(p.ny):
        kind = p.sensor_kind[c]
        i, a, j, b = p.sensor_i[c], p.sensor_a[c], p.sensor_j[c], p.sensor_b[c]
        if kind == POSITION:
            m.y[c] = a * m.x[i] + b * m.x[j]
        elif kind == SPEED:
            m.y[c] = a * m.x[nq + i] + b * m.x[nq + j]
        elif kind == ACCELERATION:  # mean of the last substep
            m.y[c] = (a * (m.x[nq + i] - m.v_before[i]) + b * (m.x[nq + j] - m.v_before[j])) / m.h
        elif kind == TENSION:
            m.y[c] = tension(m, p.sensor_of[c])
        else:
            m.y[c] = current(p, m, p.sensor_of[c])


def state_space(p: GraphParams) -> tuple[np.ndarray, np.ndarray]:
    """A (nx, nx) and B (nx, nu), commands in, without weight and dry friction."""
    A, G = np.zeros((p.nx, p.nx)), np.zeros((p.nx, p.nu + p.nq))
    assemble.interpret(p, A, G)
    return A, G[:, : p.nu]
