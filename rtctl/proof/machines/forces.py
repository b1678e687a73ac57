"""Forces by position, joint forces, and resulting accelerations.

State: coordinates (NB), their speeds (NB), currents of the voltage drives (ND), relaxing springs (NB).
"""

import numpy as np

from rtctl.proof.machines.arrays import ENDLESS, NB, ND, NE, NG, NH, NJ, NW
from rtctl.proof.machines.compiled import compiled
from rtctl.proof.machines.friction import dry, level, steady

QV, QI, QR, NX = NB, 2 * NB, 2 * NB + ND, 3 * NB + ND


@compiled
def gravity(m, i, q):
    """Gravity force (N or Nm) at position `q`: the described part and the part missing in the description."""
    f = -m.b_gc[i] - m.b_gxc[i]
    for g in range(NG):
        if m.b_g[i, g] != 0.0:
            f -= m.b_g[i, g] * np.sin(q + m.b_ga[i, g])
    if m.b_gx[i] != 0.0:
        f -= m.b_gx[i] * np.sin(q + m.b_gxa[i])
    return f


@compiled
def by_position(m, i, q):
    """Force (N or Nm) of springs, imbalance, cogging, bumps and wells at position `q`."""
    f = 0.0
    if m.b_im[i] != 0.0:
        f -= m.b_im[i] * np.sin(q + m.b_ima[i])
    for h in range(NH):
        if m.b_cog[i, h] != 0.0:
            f += m.b_cog[i, h] * np.sin(m.b_cogn[i, h] * q + m.b_coga[i, h])
    if m.b_k[i] != 0.0 or m.b_k3[i] != 0.0:
        x = q - m.b_x0[i]
        s = m.b_k[i] * x + m.b_k3[i] * x * x * x
        if m.b_ksat[i] < ENDLESS:
            s = m.b_ksat[i] * np.tanh(s / m.b_ksat[i])
        f -= s
    if m.b_hump[i] != 0.0:
        r = (q - m.b_humpat[i]) / m.b_humpw[i]
        if m.b_humpform[i] == 0.0:
            f -= m.b_hump[i] * np.exp(-0.5 * r * r)
        elif abs(r) < 2.0:
            f -= m.b_hump[i] * np.cos(0.25 * np.pi * r) ** 2
    if m.b_well[i] != 0.0:
        for k in range(NW):
            r = (q - m.b_wellat[i, k]) / m.b_wellw[i]
            f -= m.b_well[i] * r * np.exp(0.5 - 0.5 * r * r)
    return f


@compiled
def dead_zone(e, half, soft):
    """Deflection beyond a gap of +-`half`, and its derivative; `soft` rounds the edges (same unit)."""
    if half <= 0.0:
        return e, 1.0
    if soft <= 0.0:
        if abs(e) <= half:
            return 0.0, 0.0
        return e - np.sign(e) * half, 1.0
    a, b = e - half, e + half
    ra, rb = np.sqrt(a * a + soft * soft), np.sqrt(b * b + soft * soft)
    return 0.5 * (a + ra) + 0.5 * (b - rb), 1.0 + 0.5 * (a / ra - b / rb)


@compiled
def stretch(m, j, qa, qb, va, vb):
    """Elongation of joint `j`, its rate, and the lever ratios of the two ends."""
    e, de = qb - m.j_n[j] * qa, vb - m.j_n[j] * va
    on_a, on_b = m.j_n[j], -1.0
    for h in range(NH):
        A = m.j_rip[j, h]
        if A != 0.0:
            n, p = m.j_ripn[j, h], m.j_ripa[j, h]
            if m.j_ripend[j] == 0.0:
                e -= A * (np.sin(n * qa + p) - np.sin(p))
                slope = A * n * np.cos(n * qa + p)
                de -= slope * va
                on_a += slope
            else:
                e += A * (np.sin(n * qb + p) - np.sin(p))
                slope = A * n * np.cos(n * qb + p)
                de += slope * vb
                on_b -= slope
    return e, de, on_a, on_b


@compiled
def elastic(m, j, x, t, loose):
    """Elastic force of joint `j` at deflection `x` (without slip and gap), and its contact 0 to 1."""
    y, contact = dead_zone(x, 0.5 * m.j_gap[j], m.j_soft[j])
    k = m.j_k[j]
    if m.j_beta[j] != 0.0:
        r = abs(y) / m.j_e0[j]
        if m.j_p[j] > 0.0:
            k *= 1.0 + m.j_beta[j] * r ** m.j_p[j]
        else:
            k *= 1.0 + m.j_beta[j] * (np.exp(min(r, 20.0)) - 1.0) / 1.718281828
    if m.j_par[j] != 0.0:
        k *= 1.0 + m.j_par[j] * np.sin(2.0 * np.pi * m.j_parf[j] * t)
    return k * y * (1.0 - loose), contact


@compiled
def hysteresis(m, j, de, z):
    """Rate-independent hysteresis force of joint `j` after a further deflection `de`; updates `z` (NE,) in place."""
    H, z0 = m.j_H[j], m.j_z0[j]
    if m.j_Hlaw[j] == 1.0:
        top = z0 if de > 0.0 else -z0
        if de != 0.0:
            z[0] = top + (z[0] - top) * np.exp(-abs(de) / z0)
        return H * z[0] / z0
    f = 0.0
    for e in range(NE):
        reach = z0 * 0.4 * 2.0**e
        z[e] = min(max(z[e] + de, -reach), reach)
        f += H / NE * z[e] / reach
    return f


@compiled
def rate(m, x, t, q0, e0, z, zj, xs, loose, force, push, spot, dx, T, zt, acc):
    """State derivative: fills dx (NX,) at state `x`, T (NJ,) with joint forces, acc (NB,) with body accelerations.

    q0 (NB,), e0 (NJ,): positions and elongations at the start of the step, the time of the memories z (NB, NE) and zj
    (NJ, NE). xs, loose (NJ,): slip and looseness. force (ND,): drive forces, voltages for voltage drives. push, spot
    (NB,): noise and intermittent dry friction. zt (NE,): scratch.
    """
    nb, nj, nd = int(m.nb), int(m.nj), int(m.nd)
    F, M = acc, dx[QV : QV + NB]
    for i in range(NB):
        F[i] = 0.0
        M[i] = 0.0
        dx[i] = x[QV + i]
        dx[QR + i] = 0.0
    load = np.zeros(NB)
    for j in range(nj):
        if m.j_rigid[j] != 0.0:
            continue
        a, b = int(m.j_a[j]), int(m.j_b[j])
        ca, cb = int(m.b_coord[a]), int(m.b_coord[b])
        ra, rb = m.b_ratio[a], m.b_ratio[b]
        e, de, on_a, on_b = stretch(m, j, ra * x[ca], rb * x[cb], ra * x[QV + ca], rb * x[QV + cb])
        f, contact = elastic(m, j, e - xs[j], t, loose[j])
        if m.j_eta[j] == 0.0 and m.j_limit[j] < ENDLESS:
            f = min(max(f, -m.j_limit[j]), m.j_limit[j])
        f += m.j_d[j] * de * contact * (1.0 - loose[j])
        if m.j_H[j] != 0.0:
            for k in range(NE):
                zt[k] = zj[j, k]
            f += hysteresis(m, j, e - e0[j], zt)
        T[j] = f
        F[ca] += ra * on_a * f
        F[cb] += rb * on_b * f
        load[a] += abs(m.j_n[j] * f)
        load[b] += abs(f)
    for d in range(nd):
        i = int(m.d_at[d])
        c, r = int(m.b_coord[i]), m.b_ratio[i]
        f = force[d]
        v = r * x[QV + c]
        if m.d_kind[d] == 1.0:
            V = f - m.d_Kt[d] * v
            if m.d_L[d] > 0.0:
                dx[QI + d] = (V - m.d_R[d] * x[QI + d]) / m.d_L[d]
                f = m.d_Kt[d] * x[QI + d]
            else:
                dx[QI + d] = 0.0
                f = m.d_Kt[d] * V / m.d_R[d]
        elif m.d_emf[d] != 0.0:
            if m.d_emftau[d] > 0.0:
                dx[QI + d] = (v - x[QI + d]) / m.d_emftau[d]
                v = x[QI + d]
            f -= m.d_emf[d] * v
        for h in range(NH):
            if m.d_rip[d, h] != 0.0:
                f *= 1.0 + m.d_rip[d, h] * np.sin(m.d_ripn[d, h] * r * x[c] + m.d_ripa[d, h])
        F[c] += r * f
    for i in range(nb):
        c, r = int(m.b_coord[i]), m.b_ratio[i]
        q, v = r * x[c], r * x[QV + c]
        own = gravity(m, i, q)
        J = m.b_J[i]
        f = own + by_position(m, i, q) + push[i]
        if m.b_Ja[i] != 0.0:
            w = m.b_Jn[i] * q + m.b_Jp[i]
            f += 0.5 * J * m.b_Ja[i] * m.b_Jn[i] * np.sin(w) * v * v
            J *= 1.0 + m.b_Ja[i] * np.cos(w)
        other = int(m.b_crossj[i])
        f -= steady(m, i, v, m.b_ratio[other] * x[QV + int(m.b_coord[other])])
        for k in range(NE):
            zt[k] = z[i, k]
        f -= dry(m, i, level(m, i, q, v, load[i], abs(own), t, spot[i]), v, q - q0[i], zt)
        if m.b_relax[i] != 0.0:
            f -= m.b_relax[i] * (q - x[QR + i])
            dx[QR + i] = (q - x[QR + i]) / m.b_relaxtau[i]
        F[c] += r * f
        M[c] += r * r * J
    for c in range(nb):
        if M[c] > 0.0:
            M[c] = F[c] / M[c]
    for i in range(nb - 1, -1, -1):
        acc[i] = m.b_ratio[i] * dx[QV + int(m.b_coord[i])]
    for j in range(nj, NJ):
        T[j] = 0.0
