"""Drives: force, current or voltage from a command, behind a second-order low pass that may have a zero.

    x' = w z,  z' = w (gain u - x) - 2 zeta w z,  y = x + zero x'     low pass; y = gain u without one
    F = y,   F = K y,   or  L I' = y - R I - K e',  F = K I   (L = 0: I follows at once)

Source: Spong, Hutchinson & Vidyasagar, Robot Modeling and Control (2006), ch. 6; the zero is that of the L292 bridge.
"""

from rtctl.idiom import tick
from rtctl.plants.graph.params import CURRENT, VOLTAGE
from rtctl.plants.graph.spring import spring


@tick
def drive(A, G, p, m, d):
    """States of drive `d`, and the force that it puts on its coordinates."""
    nq, at = p.nq, p.drive_at[d]
    i, a, j, b = p.drive_i[d], p.drive_a[d], p.drive_j[d], p.drive_b[d]
    kind, K, w = p.drive_kind[d], p.drive_K[d], p.drive_w[d]
    wi, wj = a / m.inertia[i], b / m.inertia[j]
    made = -1  # state of the low pass's output, in N, A or V
    if w > 0.0:
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
        spring(A, m, i, a, j, b, 0.0, K * factor)
    if made >= 0:
        A[nq + i, made] += wi * factor
        A[nq + j, made] += wj * factor
        A[nq + i, made + 1] += wi * factor * p.drive_zero[d] * w
        A[nq + j, made + 1] += wj * factor * p.drive_zero[d] * w
    else:
        G[nq + i, d] += wi * factor * p.drive_gain[d]
        G[nq + j, d] += wj * factor * p.drive_gain[d]


@tick
def current(p, m, d):
    """Current of drive `d`, A; of a force drive the current at a torque constant of 1."""
    nq, at, w = p.nq, p.drive_at[d], p.drive_w[d]
    given = m.x[at] + p.drive_zero[d] * w * m.x[at + 1] if w > 0.0 else p.drive_gain[d] * m.u[d]
    if p.drive_kind[d] != VOLTAGE:
        return given
    if p.drive_L[d] > 0.0:
        return m.x[at + 2] if w > 0.0 else m.x[at]
    speed = p.drive_a[d] * m.x[nq + p.drive_i[d]] + p.drive_b[d] * m.x[nq + p.drive_j[d]]
    return (given - p.drive_K[d] * speed) / p.drive_R[d]


@tick
def drive_force(p, m, d):
    """Force of drive `d`, N or Nm."""
    return p.drive_K[d] * current(p, m, d)
