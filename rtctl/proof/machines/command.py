"""Drive model from command to force: slew, offset, dead band, gain by sign, limit, supply, heat, lags, bandwidth."""

import numpy as np

from rtctl.proof.machines.arrays import ENDLESS, ND
from rtctl.proof.machines.compiled import compiled
from rtctl.proof.machines.forces import dead_zone


@compiled
def slewed(m, d, u, now, h):
    """Command after the rate limit, advanced from `now` by `h` s towards `u`."""
    top = m.d_slew[d] * h
    if m.d_slew[d] >= ENDLESS:
        return u
    if m.d_slewsoft[d] > 0.0:  # smooth rate limit
        return now + top * np.tanh((u - now) / max(m.d_slewsoft[d] * m.d_slew[d], 1e-30))
    return now + min(max(u - now, -top), top)


@compiled
def wanted(m, d, u, heat, drawn, t):
    """Setpoint of drive `d` (N, Nm; V for a voltage drive) for the command `u`."""
    u, _ = dead_zone(u + m.d_offset[d], m.d_band[d], m.d_bandsoft[d])
    u *= 1.0 + m.d_asym[d] * np.sign(u)
    top = m.d_sat[d]
    if top < ENDLESS:
        if m.d_satsoft[d] > 0.0:
            p = 2.0 + 1.0 / m.d_satsoft[d]
            u = u / (1.0 + abs(u / top) ** p) ** (1.0 / p)
        else:
            u = min(max(u, -top), top)
    f = m.d_gain[d] * u * (1.0 - m.d_heat[d] * heat) / (1.0 + m.d_sag[d] * drawn)
    if m.d_pulse[d] != 0.0:
        f *= 1.0 + m.d_pulse[d] * np.sin(2.0 * np.pi * m.d_pulsef[d] * t)
    return f


@compiled
def filtered(m, goal, lag, lag2, F, dF, T, h):
    """Advance the drives' lags and bandwidth by `h` s; T (ND, 2, 2) is the exact transition of the bandwidth."""
    for d in range(ND):
        aim = goal[d]
        if m.d_lag[d] > 0.0:
            lag[d] = aim + (lag[d] - aim) * np.exp(-h / m.d_lag[d])
            aim = lag[d]
        if m.d_lag2[d] > 0.0:
            lag2[d] = aim + (lag2[d] - aim) * np.exp(-h / m.d_lag2[d])
            aim = lag2[d]
        if m.d_w[d] > 0.0:
            a, b = F[d] - aim, dF[d]
            F[d] = aim + T[d, 0, 0] * a + T[d, 0, 1] * b
            dF[d] = T[d, 1, 0] * a + T[d, 1, 1] * b
        else:
            F[d] = aim
