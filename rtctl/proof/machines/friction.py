"""Friction of a body against the frame: dry with bristles, viscous, drag, and forms beyond a usual library.

Dry friction is elastic below a bristle's travel and slides beyond it: a machine at rest stands still without a dead
zone in speed. `dq` is the displacement since the last whole step; `z` is the bristle's deflection at that step.
"""

import numpy as np

from rtctl.proof.machines.arrays import NE
from rtctl.proof.machines.compiled import compiled


@compiled
def level(m, i, q, v, load, carried, t, spot):
    """Level of dry friction (N or Nm, >= 0) at speed `v`, without asymmetry."""
    F = m.b_F[i]
    if m.b_Fs[i] != 0.0:
        r = abs(v) / m.b_vs[i]
        form = m.b_fall[i]
        if form == 0.0:
            F += m.b_Fs[i] * np.exp(-r * r)
        elif form == 1.0:
            F += m.b_Fs[i] * np.exp(-r)
        else:
            F += m.b_Fs[i] / (1.0 + r * r)
    if m.b_pF[i] != 0.0:
        r = (q - m.b_pat[i]) / m.b_pw[i]
        if m.b_pform[i] == 0.0:
            F += m.b_pF[i] * 0.5 * (1.0 + np.sin(r))
        elif m.b_pform[i] == 1.0:
            F += m.b_pF[i] / (1.0 + np.exp(-4.0 * r))
        else:
            F += m.b_pF[i] * np.exp(-0.5 * r * r)
    F += m.b_mu[i] * load + m.b_mu_g[i] * carried
    if m.b_warm[i] != 0.0:
        F *= 1.0 - m.b_warm[i] * (1.0 - np.exp(-t / m.b_warm_tau[i]))
    if m.b_wander[i] != 0.0:
        w = 2.0 * np.pi * m.b_wanderf[i] * t
        F += m.b_wander[i] * (1.0 + np.sin(w + 1.7 * np.sin(0.381966 * w)))
    if spot != 0.0:
        F += spot
    return max(F, 0.0)


@compiled
def dry(m, i, F, v, dq, z):
    """Dry friction (N or Nm) at displacement `dq` since the start of the step; updates `z` (NE,) in place."""
    up, down = F * (1.0 + m.b_as[i]), F * (1.0 - m.b_as[i])
    law = m.b_law[i]
    sigma = m.b_sigma[i]
    if law == 2.0:
        f = 0.0
        for e in range(NE):
            share, reach = 1.0 / NE, 0.3 * 2.0**e
            s = sigma * share / reach
            z[e] = min(max(z[e] + dq, -down * share / s), up * share / s)
            f += s * z[e]
    elif law == 1.0:
        top = up / sigma if dq > 0.0 else -down / sigma
        z[0] = top + (z[0] - top) * np.exp(-abs(dq) * sigma / max(F, 1e-30)) if dq != 0.0 else z[0]
        f = sigma * z[0]
    else:
        z[0] = min(max(z[0] + dq, -down / sigma), up / sigma)
        f = sigma * z[0]
    return min(max(f + m.b_damp[i] * v, -down), up)


@compiled
def steady(m, i, v, other):
    """Friction (N or Nm) by speed alone: viscous, drag, and unknown brakes; `other` is another body's speed."""
    f = m.b_B[i] * v + m.b_Bas[i] * abs(v)
    if m.b_quad[i] != 0.0:
        f += m.b_quad[i] * np.sign(v) * abs(v) ** m.b_power[i]
    if m.b_eddy[i] != 0.0:
        r = v / m.b_eddyv[i]
        f += m.b_eddy[i] * 2.0 * r / (1.0 + r * r)
    if m.b_cross[i] != 0.0:
        f += m.b_cross[i] * v * other
    if m.b_neg[i] != 0.0:
        r = (abs(v) - m.b_negv[i]) / m.b_negw[i]
        f -= m.b_neg[i] * np.exp(-r * r) * np.sign(v)
    return f
