"""Reels: bodies whose radius and inertia follow the tape that they wind.

    R = R_0 + d q / 2 pi,   l = integral of R dq,   J = J_0 + (pi/2) rho h (R^4 - R_0^4)
    T = c (l_i +- l_j) + k (R_i q_i' +- R_j q_j')         tension of a span; it acts on each end at that end's radius

The layer that lands moves at the reel's own surface speed and brings its momentum with it, so that J q'' has no J' q'
beside it. The linear model is made anew when a radius has moved by half a percent; in between the difference
is a force.

Source: thesis (4.1)-(4.8).
"""

import math

import numpy as np

from rtctl.idiom import tick
from rtctl.plants.graph.drives import drive_force

RELINEARISE = 5e-3  # of a radius: the explicit correction forces stay a hundred times below the linear ones


@tick
def reel_inertia(J_0, rho_h, R, R_min):
    """Inertia in kg m^2 of a reel with tape of `rho_h` kg/m^2 (density times width) up to radius R (4.1)."""
    return J_0 + 0.5 * np.pi * rho_h * (R**4 - R_min**4)


@tick
def wound(q, R, grow, R_min):
    """Tape wound by a reel of radius `R` that turns by `q` and grows by `grow` per radian; its core stays R_min."""
    if R + grow * q >= R_min:
        return (R + 0.5 * grow * q) * q
    q_end = (R_min - R) / grow
    return (R + 0.5 * grow * q_end) * q_end + R_min * (q - q_end)


@tick
def start_reels(p, m):
    """Radius and inertia at the start."""
    for k in range(p.reels):
        m.reel_R[k], m.reel_J[k] = p.reel_R[k], p.inertia[p.reel_i[k]]


@tick
def linearise(p, m):
    """Present radii and inertias into the parameters of the matrices."""
    for k in range(p.reels):
        m.reel_R_lin[k], m.inertia[p.reel_i[k]] = m.reel_R[k], m.reel_J[k]
    for n in range(p.nl):
        if p.link_wound[n] != 0:
            i, j = p.link_reel_i[n], p.link_reel_j[n]
            m.link_a[n] = m.reel_R[i] if i >= 0 else p.link_a[n]
            m.link_b[n] = math.copysign(m.reel_R[j], p.link_b[n]) if j >= 0 else p.link_b[n]


@tick
def grow(p, m):
    """Radii and inertias at the middle of the substep; whether the matrices have to be made anew."""
    anew = False
    for k in range(p.reels):
        i, R_0 = p.reel_i[k], p.reel_R[k]
        R = max(R_0 + p.reel_grow[k] * m.qm[i], p.reel_core[k])
        m.reel_R[k] = R
        m.reel_J[k] = p.inertia[i] + p.reel_paper[k] * (R**4 - R_0**4)
        m.reel_pull[k] = 0.0
        m.reel_pull_lin[k] = 0.0
        if abs(R - m.reel_R_lin[k]) > RELINEARISE * m.reel_R_lin[k]:
            anew = True
    return anew


@tick
def wind(p, m):
    """Forces of radii and inertias that follow the tape, in addition to the last linear model."""
    for n in range(p.nl):
        of_i, of_j = p.link_reel_i[n], p.link_reel_j[n]
        if of_i < 0 and of_j < 0:
            continue
        i, j, a, b, c, k = m.link_i[n], m.link_j[n], m.link_a[n], m.link_b[n], m.link_c[n], m.link_k[n]
        T_lin = c * (a * m.qm[i] + b * m.qm[j]) + k * (a * m.vm[i] + b * m.vm[j])
        T, at_i, at_j = T_lin, a, b
        if p.link_wound[n] != 0:
            way_i, way_j, e = a * m.qm[i], b * m.qm[j], 0.0
            if of_i >= 0:
                at_i = m.reel_R[of_i]
                way_i = wound(m.qm[i], p.reel_R[of_i], p.reel_grow[of_i], p.reel_core[of_i])
                e += way_i - a * m.qm[i]
            if of_j >= 0:
                at_j = math.copysign(m.reel_R[of_j], b)
                way_j = math.copysign(1.0, b) * wound(m.qm[j], p.reel_R[of_j], p.reel_grow[of_j], p.reel_core[of_j])
                e += way_j - b * m.qm[j]
            T = c * (way_i + way_j) + k * (at_i * m.vm[i] + at_j * m.vm[j])
            m.link_e[n] = e
            m.link_T[n] += T - T_lin - c * e  # linear.tension is then the tension at the true radius
        if of_i >= 0:
            m.reel_pull[of_i] -= at_i * T
            m.reel_pull_lin[of_i] -= a * T_lin
        else:
            m.f[i] -= a * (T - T_lin)
        if of_j >= 0:
            m.reel_pull[of_j] -= at_j * T
            m.reel_pull_lin[of_j] -= b * T_lin
        else:
            m.f[j] -= b * (T - T_lin)
    for k in range(p.reels):
        i = p.reel_i[k]
        ratio = m.inertia[i] / m.reel_J[k]  # every torque on the reel acts on its present inertia
        others = others_on(p, m, i) if p.reel_moved[k] != 0 else 0.0
        m.f[i] = m.f[i] * ratio + ((m.reel_pull[k] + others) * ratio - (m.reel_pull_lin[k] + others))


@tick
def others_on(p, m, i):
    """Torque on coordinate `i` of the linear model without its joints: drives and viscous friction, Nm."""
    torque = -p.viscous[i] * m.vm[i]
    for d in range(p.nu):
        if p.drive_i[d] == i:
            torque += p.drive_a[d] * drive_force(p, m, d)
        if p.drive_j[d] == i:
            torque += p.drive_b[d] * drive_force(p, m, d)
    return torque
