"""Right-hand side of the true machine: springs, tape contact, dry friction and other forces on nodes.

Dry friction has three laws. The elastic stop follows the displacement since the start of the step and is limited at the
level: it needs no small step and does not creep. The exponential bristle (Dahl 1968, LuGre with the Stribeck level:
Canudas de Wit 1995) is solved over the displacement in closed form. The steep law is a level times tanh(v / v_eps).
"""

import numpy as np

from rtctl.proof.compiled import compiled
from rtctl.proof.machine import DAHL, NH, NQ, NS, STOP

QV, BR, SLIP, NX = NQ, 2 * NQ, 2 * NQ + 2 * NS, 2 * NQ + 2 * NS + 1  # first speed, branch and tape slip; length
LOCK = 0.5  # share of the tension of each side that loads a node's friction


@compiled
def _soft_plus(x, w):
    return 0.5 * (x + np.sqrt(x * x + w * w))


@compiled
def dry_friction(m, i, v, dq, z0, load, spot, warm):
    """Friction torque (Nm or N) that opposes node `i`, and the bristle's displacement `dq` after z0."""
    level = m.q_F_C[i]
    if level == 0.0 and load == 0.0 and spot == 0.0:
        return 0.0, 0.0
    a = abs(v)
    if m.q_F_s[i] != 0.0:
        level += m.q_F_s[i] * np.exp(-((a / m.q_v_s[i]) ** m.q_delta[i]))
    level = (level + load + spot) * (1.0 + warm)
    up, down = level * (1.0 + m.q_asym[i]), level * (1.0 - m.q_asym[i])
    law, sigma = m.q_friction_law[i], m.q_sigma0[i]
    if law == STOP:
        z = z0 + dq
        if z >= up / sigma:
            return up, up / sigma
        if z <= -down / sigma:
            return -down, -down / sigma
        r = z * sigma / level
        return sigma * z + m.q_sigma1[i] * v * max(1.0 - r * r, 0.0), z
    if law == DAHL:
        end = up / sigma if dq > 0.0 else -down / sigma
        z = end + (z0 - end) * np.exp(-abs(dq / end))
        ahead = up / sigma if v > 0.0 else -down / sigma
        return sigma * z + m.q_sigma1[i] * v * (1.0 - z / ahead), z
    steep = np.tanh(v / m.q_v_eps[i])
    return level * (steep + m.q_asym[i] * abs(steep)), 0.0


@compiled
def spring_force(m, s, x, xs, slip):
    """Spring `s` at state `x`: force, arm at i, arm at j, and elastic force before the limit."""
    i, j = int(m.s_i[s]), int(m.s_j[s])
    qi, vi = x[i], x[QV + i]
    ri = m.s_a_i[s] + m.s_grow_i[s] * qi
    e = (m.s_a_i[s] + 0.5 * m.s_grow_i[s] * qi) * qi - xs
    for n in range(NH):
        if m.ecc_i[s, n] != 0.0:
            a = (n + 1) * qi + m.ecc_pi[s, n]
            ri += m.ecc_i[s, n] * np.cos(a)
            e += m.ecc_i[s, n] / (n + 1) * (np.sin(a) - np.sin(m.ecc_pi[s, n]))
    rj = 0.0
    de = ri * vi
    if j >= 0:
        qj, vj = x[j], x[QV + j]
        rj = m.s_a_j[s]
        e += rj * qj
        for n in range(NH):
            if m.ecc_j[s, n] != 0.0:
                a = (n + 1) * qj + m.ecc_pj[s, n]
                rj += m.ecc_j[s, n] * np.cos(a)
                e += m.ecc_j[s, n] / (n + 1) * (np.sin(a) - np.sin(m.ecc_pj[s, n]))
        de += rj * vj
    if slip != 0.0:
        e += slip if m.s_a_j[s] > 0.0 else -slip
    damping = m.s_k[s]
    if m.s_gap[s] > 0.0:
        half, w = 0.5 * m.s_gap[s], m.s_gap_smooth[s]
        free = e
        e = _soft_plus(free - half, w) - _soft_plus(-free - half, w)
        if m.s_gap_damped[s] == 0.0 and abs(free) < half:
            damping = 0.0
    c = m.s_c[s]
    if m.s_par_a[s] != 0.0:
        c *= 1.0 + m.s_par_a[s] * np.sin(m.s_par_n[s] * qi)
    elastic = c * e + m.s_c3[s] * e * e * e
    force = min(max(elastic, -m.s_limit[s]), m.s_limit[s])
    if force == elastic:
        force += damping * de
    for n in range(2):
        if m.br_c[s, n] != 0.0:
            force += x[BR + 2 * s + n]
    if m.s_pull_only[s] != 0.0:
        force = max(force, 0.0)
    return force, ri, rj, elastic, de


@compiled
def rate(m, x, q0, z0, xs, current, heat, push, spot, ring, det, dx, F, net):
    """State derivative: fills dx (NX) at state x, F (NS) with spring forces, net (NQ) with their node torques."""
    nq, ns = int(m.nq), int(m.ns)
    for i in range(nq):
        net[i] = 0.0
    slip = x[SLIP]
    contact, k_sum = 0.0, 0.0
    for s in range(ns):
        F[s], ri, rj, _, de = spring_force(m, s, x, xs[s], slip)
        net[int(m.s_i[s])] -= ri * F[s]
        j = int(m.s_j[s])
        if j >= 0:
            net[j] -= rj * F[s]
        for n in range(2):
            if m.br_c[s, n] != 0.0:
                dx[BR + 2 * s + n] = m.br_c[s, n] * de - x[BR + 2 * s + n] / m.br_tau[s, n]
        if j == 4:
            contact += -F[s] if m.s_a_j[s] > 0.0 else F[s]
            k_sum += m.s_k[s]
    dx[SLIP] = 0.0
    if m.cap_limit < 1e29 or m.cap_creep != 0.0:
        _slide(m, x, F, net, dx, contact, k_sum, ns)
    for d in range(int(m.nu)):
        net_i = int(m.d_node[d])
        net[net_i] += m.d_K[d] * current[d] * (1.0 - m.d_heat_gain[d] * heat[d])
    for i in range(nq):
        q, v = x[i], x[QV + i]
        J = m.q_J[i]
        load = 0.0
        if m.q_mu_load[i] != 0.0:
            for s in range(ns):
                load += m.load_on[i, s] * abs(F[s])
            load *= m.q_mu_load[i]
        warm = 0.0
        if m.q_warm_F[i] != 0.0:
            warm = m.q_warm_F[i] * heat[1 if m.nu > 1.0 and i == int(m.d_node[1]) else 0]
        f, _ = dry_friction(m, i, v, q - q0[i], z0[i], load, m.q_spot_F[i] * spot, warm)
        total = net[i] - f - m.q_B[i] * v + push[i] + ring[i]
        total += other(m, i, q, v, det[i])
        if m.q_gyro[i] != 0.0:
            total -= m.q_gyro[i] * v * x[QV + int(m.d_node[0])]
        for s in range(ns):
            if m.s_rho_h[s] != 0.0 and int(m.s_i[s]) == i:
                R = m.s_a_i[s] + m.s_grow_i[s] * q
                J += 0.5 * np.pi * m.s_rho_h[s] * (R**4 - m.s_a_i[s] ** 4)
        dx[i] = v
        dx[QV + i] = total / J


@compiled
def _slide(m, x, F, net, dx, contact, k_sum, ns):
    """Slip of the tape on its roller (node 4): it limits the contact force, or creeps."""
    grip = m.cap_creep * abs(x[QV + 4])
    rate_ = grip * contact / (1.0 + grip * k_sum)  # creep at the contact force with damping
    if abs(contact) > m.cap_limit:
        rate_ += (contact - np.sign(contact) * m.cap_limit) / k_sum
    dx[SLIP] = rate_
    for s in range(ns):
        if int(m.s_j[s]) == 4:
            change = m.s_k[s] * rate_ * (1.0 if m.s_a_j[s] > 0.0 else -1.0)
            if m.s_pull_only[s] != 0.0:
                change = max(change, -F[s])
            F[s] += change
            net[int(m.s_i[s])] -= m.s_a_i[s] * change
            net[4] -= m.s_a_j[s] * change


@compiled
def other(m, i, q, v, det):
    """Torque on node `i` of effects that depend only on its position and speed."""
    f = 0.0
    for n in range(4):
        if m.wave_a[i, n] != 0.0:
            f -= m.wave_a[i, n] * np.sin(m.wave_n[i, n] * q + m.wave_ph[i, n])
    if m.q_k_pos[i] != 0.0 or m.q_k_pos3[i] != 0.0:
        f -= m.q_k_pos[i] * q + m.q_k_pos3[i] * q * q * q
    if m.q_bump_F[i] != 0.0:
        r = (q - m.q_bump_at[i]) / m.q_bump_w[i]
        if abs(r) < 6.0:
            bell = m.q_bump_F[i] * np.exp(-0.5 * r * r)
            f += bell * (r * 1.6487 * (1.0 - m.q_bump_drag[i]) - m.q_bump_drag[i] * np.tanh(v / m.q_v_eps[i]))
    if m.q_F_q[i] != 0.0:
        f -= m.q_F_q[i] * v * abs(v)
    if m.q_F_neg[i] != 0.0:
        r = (abs(v) - m.q_v_neg[i]) / m.q_w_neg[i]
        f += m.q_F_neg[i] * np.exp(-r * r) * np.sign(v)
    if m.q_det_a[i] != 0.0:
        f -= m.q_det_a[i] * np.sin(m.q_det_n[i] * (q - det))
    return f
