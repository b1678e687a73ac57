"""States outside the differential equations, and discrete modes of dry friction and joints."""

import numpy as np

from rtctl.proof.machines.arrays import ENDLESS, NB, PRANDTL
from rtctl.proof.machines.compiled import compiled
from rtctl.proof.machines.forces import QV, elastic, gravity, hysteresis, stretch
from rtctl.proof.machines.friction import dry, level


@compiled
def joint_begin(m, x, e0):
    """Fill e0 (NJ,): elongations at state `x`."""
    for j in range(int(m.nj)):
        a, b = int(m.j_a[j]), int(m.j_b[j])
        e, _, _, _ = stretch(m, j, m.b_ratio[a] * x[int(m.b_coord[a])], m.b_ratio[b] * x[int(m.b_coord[b])], 0.0, 0.0)
        e0[j] = e


@compiled
def remember(m, x, t, h, q0, e0, z, zj, xs, loose, last, spot, T):
    """Update the states outside the differential equations: bristles, hysteresis, slip, creep, loose screws."""
    for j in range(int(m.nj)):
        if m.j_rigid[j] != 0.0:
            continue
        a, b = int(m.j_a[j]), int(m.j_b[j])
        ca, cb = int(m.b_coord[a]), int(m.b_coord[b])
        e, _, _, _ = stretch(m, j, m.b_ratio[a] * x[ca], m.b_ratio[b] * x[cb], 0.0, 0.0)
        if m.j_H[j] != 0.0:
            hysteresis(m, j, e - e0[j], zj[j])
        f, _ = elastic(m, j, e - xs[j], t, loose[j])
        if m.j_limit[j] < ENDLESS and abs(f) > m.j_limit[j]:
            over = f - np.sign(f) * m.j_limit[j]
            xs[j] += over * h / m.j_eta[j] if m.j_eta[j] > 0.0 else over / m.j_k[j]
        if m.j_creep[j] != 0.0 or m.j_creepv[j] != 0.0:
            xs[j] += f * h * (m.j_creep[j] + m.j_creepv[j] * abs(m.b_ratio[b] * x[QV + cb]))
        if m.j_loose[j] != 0.0:
            loose[j] *= np.exp(-h / m.j_loosetau[j])
            if f * last[j] < 0.0:
                loose[j] = m.j_loose[j]
            if f != 0.0:
                last[j] = f
        e0[j] = e
    for i in range(int(m.nb)):
        c, r = int(m.b_coord[i]), m.b_ratio[i]
        q, v = r * x[c], r * x[QV + c]
        load = joint_load(m, i, T) if m.b_mu[i] != 0.0 else 0.0
        F = level(m, i, q, v, load, carried(m, i, q), t, spot[i])
        dry(m, i, F, v, q - q0[i], z[i])


@compiled
def modes(m, x, t, q0, e0, z, xs, loose, T, spot, mode):
    """Whether a mode changed since the last call: a body sticks or slides, a joint is in contact, slips or reverses.

    Updates mode (NB + NJ,) in place. Call before `remember`, with the arguments of `rate`.
    """
    changed = False
    for i in range(int(m.nb)):
        c, r = int(m.b_coord[i]), m.b_ratio[i]
        q, v = r * x[c], r * x[QV + c]
        now = np.sign(v)
        if m.b_law[i] == PRANDTL:
            load = joint_load(m, i, T) if m.b_mu[i] != 0.0 else 0.0
            F = level(m, i, q, v, load, carried(m, i, q), t, spot[i])
            up, down = F * (1.0 + m.b_as[i]), F * (1.0 - m.b_as[i])
            f = m.b_sigma[i] * min(max(z[i, 0] + q - q0[i], -down / m.b_sigma[i]), up / m.b_sigma[i]) + m.b_damp[i] * v
            now = 0.0
            if F > 0.0 and f >= up:
                now = 1.0
            elif F > 0.0 and f <= -down:
                now = -1.0
        changed = changed or now != mode[i]
        mode[i] = now
    for j in range(int(m.nj)):
        if m.j_gap[j] == 0.0 and m.j_limit[j] >= ENDLESS and m.j_H[j] == 0.0:
            continue
        a, b = int(m.j_a[j]), int(m.j_b[j])
        ca, cb = int(m.b_coord[a]), int(m.b_coord[b])
        ra, rb = m.b_ratio[a], m.b_ratio[b]
        e, de, _, _ = stretch(m, j, ra * x[ca], rb * x[cb], ra * x[QV + ca], rb * x[QV + cb])
        f, contact = elastic(m, j, e - xs[j], t, loose[j])
        now = np.rint(contact)
        if abs(f) >= m.j_limit[j]:
            now += 2.0
        if m.j_H[j] != 0.0 and de > 0.0:
            now += 4.0
        changed = changed or now != mode[NB + j]
        mode[NB + j] = now
    return changed


@compiled
def joint_load(m, i, T):
    """Sum of the joint forces at body `i`, N or Nm."""
    load = 0.0
    for j in range(int(m.nj)):
        if int(m.j_a[j]) == i:
            load += abs(m.j_n[j] * T[j])
        if int(m.j_b[j]) == i:
            load += abs(T[j])
    return load


@compiled
def carried(m, i, q):
    """Gravity load on the friction of body `i`, N or Nm."""
    if m.b_mu_g[i] == 0.0:
        return 0.0
    return abs(gravity(m, i, q))
