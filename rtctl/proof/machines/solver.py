"""Simulation of the closed loop: Runge-Kutta of fourth order with `sub` steps a tick, exact filters of the drives.

Row k holds the readings at tick k and the commands written then; a command acts `delay` sample times later. Before the
first row the machine settles under the law with reference 0 and no excitation.
"""

import numpy as np

from rtctl.proof.machines.arrays import NB, ND, NE, NJ, NS
from rtctl.proof.machines.command import filtered, slewed, wanted
from rtctl.proof.machines.compiled import compiled
from rtctl.proof.machines.forces import NX, QV, rate
from rtctl.proof.machines.law import law_tick
from rtctl.proof.machines.memory import joint_begin, modes, remember
from rtctl.proof.machines.reading import raw
from rtctl.proof.solver import second_order

FINER = 10  # substeps of a step with a change of a friction or contact mode
RUNAWAY = 1e7  # any state above this value: the loop is unstable


@compiled
def run(m, law, start, settle, ref, w, played, push, spot, extra, lost, y, exact, u, states, joints, forces):
    """Simulate. Returns the number of rows that were finite.

    start (2 NB): coordinates and speeds. settle: ticks before the first row. ref, w (n,). played (n, ND): commands
    that stand in for the law's, or (0, ND). push, spot (n, NB) N or Nm. extra, lost (n, NS) quanta on each reading.
    Fills y, exact (n, NS): readings and readings before rounding; u (n, ND); states (n, 2 NB): positions and speeds
    of the bodies; joints (n, NJ): joint forces; forces (n, ND): of the drives, volts for voltage drives.
    """
    n, nb, nj, nd, ns = len(ref), int(m.nb), int(m.nj), int(m.nd), int(m.ns)
    x, x0, x1 = np.zeros(NX), np.zeros(NX), np.zeros(NX)
    G0, Gm, G1, mode = np.zeros(ND), np.zeros(ND), np.zeros(ND), np.zeros(NB + NJ)
    k1, k2, k3, k4 = np.zeros(NX), np.zeros(NX), np.zeros(NX), np.zeros(NX)
    x[:NB], x[QV : 2 * NB] = start[:NB], start[NB:]
    q0, e0, T, acc, zt = np.zeros(NB), np.zeros(NJ), np.zeros(NJ), np.zeros(NB), np.zeros(NE)
    z, zj, xs, loose, last = np.zeros((NB, NE)), np.zeros((NJ, NE)), np.zeros(NJ), np.zeros(NJ), np.zeros(NJ)
    F0, Fm, F1, dF = np.zeros(ND), np.zeros(ND), np.zeros(ND), np.zeros(ND)
    goal, lag, lag2, ramp = np.zeros(ND), np.zeros(ND), np.zeros(ND), np.zeros(ND)
    heat, drawn = np.zeros(ND), 0.0
    D = np.zeros((ND, 2, 2))
    volts, memory = np.zeros(ND), np.zeros(4)
    command = np.zeros((settle + n + 1, ND))
    seen, miss, zero, whole, edge = np.zeros(NS), np.zeros(NS), np.zeros(NS), np.zeros(NS), np.zeros(NS)
    sl, sl2 = np.zeros(NS), np.zeros(NS)
    none = np.zeros(NB)
    sub = int(m.sub)
    h = m.Ts / sub
    shift = int(np.rint(m.delay * sub))
    for d in range(ND):
        if m.d_w[d] > 0.0:
            second_order(m.d_w[d], m.d_z[d], 0.5 * h, D[d])
    joint_begin(m, x, e0)
    for k in range(-settle, n):
        t = max(k, 0) * m.Ts
        noise, rub = (push[k], spot[k]) if k >= 0 else (none, none)
        for i in range(nb):
            q0[i] = m.b_ratio[i] * x[int(m.b_coord[i])]
        rate(m, x, t, q0, e0, z, zj, xs, loose, F1, noise, rub, k1, T, zt, acc)
        for s in range(ns):
            value = raw(m, s, x, T, acc, F1, volts[0])
            if m.s_lag[s] > 0.0:
                sl[s] = value + ((sl[s] - value) * np.exp(-m.Ts / m.s_lag[s]) if k > -settle else 0.0)
                value = sl[s]
            if m.s_lag2[s] > 0.0:
                sl2[s] = value + ((sl2[s] - value) * np.exp(-m.Ts / m.s_lag2[s]) if k > -settle else 0.0)
                value = sl2[s]
            if k == 0 and m.s_counter[s] != 0.0:
                zero[s] = np.floor(value)
                whole[s] = 0.0
                edge[s] = 0.0
            value -= zero[s]
            if m.s_rect[s] != 0.0:
                if m.s_counter[s] == 0.0:
                    value = abs(value)
                else:
                    step = np.floor(value) - edge[s]
                    edge[s] = np.floor(value)
                    whole[s] += abs(step)
                    value = whole[s] + 0.5
            if k >= 0:
                exact[k, s] = value
                value += extra[k, s]
                if lost[k, s] != 0.0 and np.floor(value) - miss[s] != seen[s]:
                    miss[s] += lost[k, s]
            value = np.floor(value) - miss[s] if m.s_counter[s] != 0.0 else np.rint(value)
            seen[s] = value
            if k >= 0:
                y[k, s] = value
        if k >= 0 and len(played) > 0:
            for d in range(nd):
                command[settle + k, d] = played[k, d]
        else:
            law_tick(law, memory, k < 0, ref[k] if k >= 0 else 0.0, w[k] if k >= 0 else 0.0, seen, command[settle + k])
        if k >= 0:
            for d in range(nd):
                u[k, d] = command[settle + k, d]
                forces[k, d] = F1[d]
            for i in range(nb):
                states[k, i] = m.b_ratio[i] * x[int(m.b_coord[i])]
                states[k, NB + i] = m.b_ratio[i] * x[QV + int(m.b_coord[i])]
            for j in range(nj):
                joints[k, j] = T[j]
        for piece in range(sub):
            act = (settle + k) * sub + piece - shift
            if act >= 0:
                for d in range(nd):
                    volts[d] = command[act // sub, d]
            now = t + piece * h
            total = 0.0
            for d in range(nd):
                total += abs(F1[d]) / m.d_sagref[d]
            drawn += (total - drawn) * (min(h / m.d_sagtau[0], 1.0) if m.d_sagtau[0] > 0.0 else 1.0)
            for d in range(nd):
                ramp[d] = slewed(m, d, volts[d], ramp[d], h)
                goal[d] = wanted(m, d, ramp[d], heat[d], drawn, now)
                F0[d] = F1[d] if m.d_w[d] + m.d_lag[d] + m.d_lag2[d] > 0.0 else goal[d]
            filtered(m, goal, lag, lag2, F1, dF, D, 0.5 * h)
            for d in range(nd):
                Fm[d] = F1[d]
            filtered(m, goal, lag, lag2, F1, dF, D, 0.5 * h)
            for d in range(nd):
                if m.d_heat[d] != 0.0 and k >= 0:
                    heat[d] += ((Fm[d] / m.d_heatref[d]) ** 2 - heat[d]) * h / m.d_heattau[d]
            for i in range(nb):
                q0[i] = m.b_ratio[i] * x[int(m.b_coord[i])]
            for i in range(NX):
                x0[i] = x[i]
            advance(m, x, now, h, q0, e0, z, zj, xs, loose, F0, Fm, F1, noise, rub, k1, k2, k3, k4, x1, T, zt, acc)
            if modes(m, x, now + h, q0, e0, z, xs, loose, T, rub, mode):
                for i in range(NX):  # a mode changed in this step: repeat it in finer steps
                    x[i] = x0[i]
                for f in range(FINER):
                    for d in range(nd):
                        G0[d] = between(F0[d], Fm[d], F1[d], f / FINER)
                        Gm[d] = between(F0[d], Fm[d], F1[d], (f + 0.5) / FINER)
                        G1[d] = between(F0[d], Fm[d], F1[d], (f + 1.0) / FINER)
                    for i in range(nb):
                        q0[i] = m.b_ratio[i] * x[int(m.b_coord[i])]
                    a, g = now + f * h / FINER, h / FINER
                    advance(
                        m, x, a, g, q0, e0, z, zj, xs, loose, G0, Gm, G1, noise, rub, k1, k2, k3, k4, x1, T, zt, acc
                    )
                    modes(m, x, a + g, q0, e0, z, xs, loose, T, rub, mode)
                    remember(m, x, a + g, g, q0, e0, z, zj, xs, loose, last, rub, T)
            else:
                remember(m, x, now + h, h, q0, e0, z, zj, xs, loose, last, rub, T)
        if not np.abs(x[: 2 * NB]).max() < RUNAWAY:
            return max(k, 0)
    return n


@compiled
def between(a, b, c, r):
    """Value at `r` of the parabola through (0, a), (1/2, b), (1, c)."""
    return a + r * (4.0 * b - 3.0 * a - c + 2.0 * r * (a - 2.0 * b + c))


@compiled
def advance(m, x, t, h, q0, e0, z, zj, xs, loose, F0, Fm, F1, noise, rub, k1, k2, k3, k4, x1, T, zt, acc):
    """Advance x (NX,) by `h` s; F0, Fm, F1 (ND,) are the drive forces at start, middle and end of the step."""
    rate(m, x, t, q0, e0, z, zj, xs, loose, F0, noise, rub, k1, T, zt, acc)
    for i in range(NX):
        x1[i] = x[i] + 0.5 * h * k1[i]
    rate(m, x1, t + 0.5 * h, q0, e0, z, zj, xs, loose, Fm, noise, rub, k2, T, zt, acc)
    for i in range(NX):
        x1[i] = x[i] + 0.5 * h * k2[i]
    rate(m, x1, t + 0.5 * h, q0, e0, z, zj, xs, loose, Fm, noise, rub, k3, T, zt, acc)
    for i in range(NX):
        x1[i] = x[i] + h * k3[i]
    rate(m, x1, t + h, q0, e0, z, zj, xs, loose, F1, noise, rub, k4, T, zt, acc)
    for i in range(NX):
        x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
