"""Sensor readings in quanta of their columns, before rounding."""

import numpy as np

from rtctl.proof.machines.arrays import NH
from rtctl.proof.machines.compiled import compiled
from rtctl.proof.machines.forces import QI, QV, stretch


@compiled
def measured(m, s, x, T, acc, force):
    """SI value of the quantity of sensor `s` at state `x`."""
    what, at = int(m.s_what[s]), int(m.s_at[s])
    if what <= 1:
        c, r = int(m.b_coord[at]), m.b_ratio[at]
        q, v = r * x[c], r * x[QV + c]
        for h in range(NH):
            A = m.s_rip[s, h]
            if A != 0.0:
                n, p = m.s_ripn[s, h], m.s_ripa[s, h]
                angle = r * x[c]
                q += A * (np.sin(n * angle + p) - np.sin(p))
                v += A * n * np.cos(n * angle + p) * r * x[QV + c]
        return q if what == 0 else v
    if what == 2:
        return acc[at]
    if what == 3:
        a, b = int(m.j_a[at]), int(m.j_b[at])
        ca, cb = int(m.b_coord[a]), int(m.b_coord[b])
        e, _, _, _ = stretch(m, at, m.b_ratio[a] * x[ca], m.b_ratio[b] * x[cb], 0.0, 0.0)
        return e
    if what == 4:
        return T[at]
    if m.d_kind[at] == 1.0:
        if m.d_L[at] > 0.0:
            return x[QI + at]
        i = int(m.d_at[at])
        return (force[at] - m.d_Kt[at] * m.b_ratio[i] * x[QV + int(m.b_coord[i])]) / m.d_R[at]
    return force[at] / m.d_Kt[at]


@compiled
def raw(m, s, x, T, acc, force, u):
    """Reading of sensor `s` in quanta, before rounding; `u` is the command, for crosstalk."""
    value = m.s_rel[s] * measured(m, s, x, T, acc, force)
    return m.s_phase[s] + m.s_gain[s] * value + m.s_cross[s] * u
