"""Simulation of the closed loop with the true machine: Runge-Kutta of fourth order, drives solved exactly.

Row k of the output holds the sensor readings at tick k and the written voltages. A voltage acts `delay` sample times
after its tick, also between ticks. Ticks occur at the given times.
"""

import numpy as np

from rtctl.proof.compiled import compiled
from rtctl.proof.forces import NX, QV, dry_friction, rate, spring_force
from rtctl.proof.law import NL, law_tick
from rtctl.proof.machine import ENDLESS, NH, NQ, NS, NU, NY

RUNAWAY = 1e7  # any state above this value: the loop is unstable


@compiled
def wanted(m, d, u, total):
    """Setpoint of the current of drive `d` in A for `u` V, with `total` A drawn by all drives."""
    u = u + m.d_offset[d]
    band = m.d_band[d]
    if band > 0.0:
        w = m.d_band_soft[d]
        u = 0.5 * (u - band + np.sqrt((u - band) ** 2 + w * w)) - 0.5 * (-u - band + np.sqrt((u + band) ** 2 + w * w))
    a = m.d_amp[d] * u * (1.0 + m.d_asym[d] * (1.0 if u > 0.0 else -1.0)) * max(1.0 - m.d_sag[d] * total, 0.0)
    top = m.d_sat_A[d]
    if top < ENDLESS:
        p = 2.0 + 1.0 / max(m.d_sat_soft[d], 0.02)
        a = a / (1.0 + abs(a / top) ** p) ** (1.0 / p)
    return min(max(a, -m.d_current_limit[d]), m.d_current_limit[d])


@compiled
def second_order(w, z, h, T):
    """Exact transition T (2, 2), filled in place, over h of (x, x' / w) of x'' + 2 z w x' + w^2 x = 0, z < 1."""
    wd = w * np.sqrt(1.0 - z * z)
    e = np.exp(-z * w * h)
    c, s = np.cos(wd * h), np.sin(wd * h)
    r = z * w / wd
    T[0, 0] = e * (c + r * s)
    T[0, 1] = e * s * w / wd
    T[1, 0] = -e * s * w / wd
    T[1, 1] = e * (c - r * s)


@compiled
def run(m, law, start, ref, w, ticks, push, spot, extra, lost, y, u):
    """Simulate. Returns the number of rows that were finite.

    start (2 NQ): positions and speeds, replaced by those at the end. ref, w (n,); ticks (n + 1,) s, true times;
    push (n, NQ) Nm or N; spot (n,); extra (n, NY) counts on top of each reading; lost (n, NY) counts the counters miss
    when they move. Fills y (n, NY) and u (n, NU).
    """
    n, nq, nu, ny = len(ref), int(m.nq), int(m.nu), int(m.ny)
    x, x1 = np.zeros(NX), np.zeros(NX)
    k1, k2, k3, k4 = np.zeros(NX), np.zeros(NX), np.zeros(NX), np.zeros(NX)
    x[:NQ], x[QV : 2 * NQ] = start[:NQ], start[NQ:]
    q0, z, xs, F, net = np.zeros(NQ), np.zeros(NQ), np.zeros(NS), np.zeros(NS), np.zeros(NQ)
    det, ring, ring_d, last = np.zeros(NQ), np.zeros(NQ), np.zeros(NQ), np.zeros(NQ)
    I0, Im, I1, Id = np.zeros(NU), np.zeros(NU), np.zeros(NU), np.zeros(NU)
    lag, heat, goal = np.zeros(NU), np.zeros(NU), np.zeros(NU)
    T = np.zeros((NU, 2, 2))
    volts, memory = np.zeros(NU), np.zeros(NL)
    count, edge, offset, miss = np.zeros(NY), np.zeros(NY), np.zeros(NY), np.zeros(NY)
    drawn = 0.0
    act = 0
    for s in range(NY):
        edge[s] = _reading(m, s, x, 0.0)
    for k in range(n):
        t, t_end = ticks[k], ticks[k + 1]
        for s in range(ny):
            raw = _reading(m, s, x, offset[s]) + m.y_cross[s] * volts[0] + extra[k, s]
            if m.y_kind[s] == 0.0:
                if raw - miss[s] != count[s] and lost[k, s] != 0.0 and abs(x[QV + int(m.y_node[s])]) > 1e-3:
                    miss[s] += lost[k, s]
                y[k, s] = np.floor(raw) - miss[s]
                count[s] = y[k, s]
            else:
                y[k, s] = count[s]
        law_tick(law, memory, k == 0, ref[k], w[k], y[k, 0], u[k])
        while t < t_end - 1e-12:
            while act <= k and ticks[act] + m.delay * m.Ts <= t + 1e-9:
                for d in range(nu):
                    volts[d] = u[act, d]
                act += 1
            stop = t_end
            if act <= k:
                stop = min(stop, ticks[act] + m.delay * m.Ts)
            if stop > t_end - 1e-9:
                stop = t_end
            pieces = int(np.ceil((stop - t) / m.Ts * m.sub - 1e-6))
            pieces = max(pieces, 1)
            h = (stop - t) / pieces
            for d in range(nu):
                second_order(m.d_w[d], m.d_zeta[d], 0.5 * h, T[d])
            for piece in range(pieces):
                now = t + piece * h
                total = 0.0
                for d in range(nu):
                    total += abs(I1[d])
                for d in range(nu):
                    if m.d_sag_tau[d] > 0.0:
                        drawn += (total - drawn) * min(h / m.d_sag_tau[d], 1.0) / nu
                    else:
                        drawn = total
                for d in range(nu):
                    goal[d] = wanted(m, d, volts[d], drawn)
                    if m.d_pulse_a[d] != 0.0:
                        goal[d] *= 1.0 + m.d_pulse_a[d] * np.sin(2.0 * np.pi * m.d_pulse_f[d] * now)
                    I0[d] = I1[d]
                    Im[d] = _current(m, d, goal, lag, I1, Id, T, 0.5 * h)
                    I1[d] = _current(m, d, goal, lag, I1, Id, T, 0.5 * h)
                    if m.d_rms_A[d] > 0.0:
                        heat[d] += ((Im[d] / m.d_rms_A[d]) ** 2 - heat[d]) * h / m.d_heat_tau[d]
                for i in range(nq):
                    q0[i] = x[i]
                rate(m, x, q0, z, xs, I0, heat, push[k], spot[k], ring, det, k1, F, net)
                for i in range(NX):
                    x1[i] = x[i] + 0.5 * h * k1[i]
                rate(m, x1, q0, z, xs, Im, heat, push[k], spot[k], ring, det, k2, F, net)
                for i in range(NX):
                    x1[i] = x[i] + 0.5 * h * k2[i]
                rate(m, x1, q0, z, xs, Im, heat, push[k], spot[k], ring, det, k3, F, net)
                for i in range(NX):
                    x1[i] = x[i] + h * k3[i]
                rate(m, x1, q0, z, xs, I1, heat, push[k], spot[k], ring, det, k4, F, net)
                for i in range(NX):
                    x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
                _remember(m, x, q0, z, xs, F, det, ring, ring_d, last, heat, spot[k], h)
                for s in range(ny):
                    if m.y_creep[s] != 0.0:
                        i = int(m.y_node[s])
                        offset[s] -= m.y_creep[s] * net[i] * abs(x[QV + i]) * h
                    if m.y_kind[s] == 1.0:
                        new = np.floor(_reading(m, s, x, offset[s]))
                        count[s] += abs(new - np.floor(edge[s]))
                        edge[s] = new
            t = stop
        if not np.abs(x[: 2 * NQ]).max() < RUNAWAY:
            return k
    start[:NQ], start[NQ:] = x[:NQ], x[QV : 2 * NQ]
    return n


@compiled
def _reading(m, s, x, offset):
    """Reading of sensor `s` in counts, before rounding."""
    q = x[int(m.y_node[s])]
    ripple = 0.0
    for n in range(2 * NH):
        if m.rip_a[s, n] != 0.0:
            ripple += m.rip_a[s, n] * (np.sin(m.rip_n[s, n] * q + m.rip_ph[s, n]) - np.sin(m.rip_ph[s, n]))
    return m.y_phase[s] + m.y_gain[s] * m.y_relative[s] * (q + ripple + offset)


@compiled
def _current(m, d, goal, lag, I1, Id, T, h):
    """Current of drive `d` in A after a step h."""
    aim = goal[d]
    if m.d_lag[d] > 0.0:
        lag[d] = aim + (lag[d] - aim) * np.exp(-h / m.d_lag[d])
        aim = lag[d]
    a, b = I1[d] - aim, Id[d]
    I1[d] = aim + T[d, 0, 0] * a + T[d, 0, 1] * b
    Id[d] = T[d, 1, 0] * a + T[d, 1, 1] * b
    return I1[d]


@compiled
def _remember(m, x, q0, z, xs, F, det, ring, ring_d, last, heat, spot, h):
    """Update the states outside the differential equations: bristles, slipped springs, detents, ringing."""
    for i in range(int(m.nq)):
        load = 0.0
        if m.q_mu_load[i] != 0.0:
            for s in range(int(m.ns)):
                load += m.load_on[i, s] * abs(F[s])
        warm = 0.0
        if m.q_warm_F[i] != 0.0:
            warm = m.q_warm_F[i] * heat[1 if m.nu > 1.0 and i == int(m.d_node[1]) else 0]
        v = x[QV + i]
        _, z[i] = dry_friction(m, i, v, x[i] - q0[i], z[i], m.q_mu_load[i] * load, m.q_spot_F[i] * spot, warm)
        if m.q_det_a[i] != 0.0:
            det[i] = min(max(det[i], x[i] - m.q_det_play[i]), x[i] + m.q_det_play[i])
        if m.q_ring_a[i] != 0.0:
            if abs(v) > m.q_ring_v[i]:
                if last[i] * v < 0.0:
                    ring_d[i] += m.q_ring_a[i] * m.q_ring_w[i] * np.sign(v)
                last[i] = np.sign(v)
            wr = m.q_ring_w[i]
            ring_d[i] -= h * (2.0 * m.q_ring_z[i] * wr * ring_d[i] + wr * wr * ring[i])
            ring[i] += h * ring_d[i]
    for s in range(int(m.ns)):
        if m.s_limit[s] < 1e29:
            elastic = spring_force(m, s, x, xs[s], 0.0)[3]
            if abs(elastic) > m.s_limit[s]:
                xs[s] += (elastic - np.sign(elastic) * m.s_limit[s]) / m.s_c[s]
        if m.s_creep[s] != 0.0:
            xs[s] += m.s_creep[s] * F[s] * abs(x[QV + int(m.s_i[s])]) * h
