"""Exact propagation of a linear machine with forces at its nodes.

Every plant here is springs, dampers and inertias (linear, stiff, exact by the matrix exponential) plus terms of
physics that act at nodes (smooth, held over a substep at their value at its middle) plus dry friction (the reaction
force that stops the node, up to a limit):

    x' = A x + B u + E (f + r),   x = [q, v, others],   |r_i| <= dry_i, r_i opposes v_i

Over a substep h:  x+ = Phi x + Gamma_u u + Gamma_f f  is exact for constant u and f. Smooth terms are evaluated at
the extrapolated middle of the substep (second order). Dry friction is solved for the velocities at its end by
Gauss-Seidel, so that a sticking node stands exactly still instead of chattering about zero.

Source: Van Loan, Computing integrals involving the matrix exponential, IEEE TAC 23 (1978) for Phi and Gamma;
Moreau-Jean time stepping (Acary & Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, ch. 10).
"""

import numpy as np

from rtctl.idiom import state, tick
from rtctl.plants.rows import LANES, sum_rows

SWEEPS = 3  # of Gauss-Seidel, warm-started: node couplings within one substep are weak
TAYLOR = 12  # terms; the argument is scaled below a half, so the relative remainder is under 1e-13
BALANCE_SWEEPS = 20
ENDLESS = 1e100  # rate times a substep


MOST_BODIES = 12  # coordinates, as many as a machine may have; a record of one size is compiled once for all machines
MOST_DRIVES = 4
MOST_SENSORS = 12
MOST_LINKS = 16
MOST_REELS = 4
DRIVE_STATES = 3
MOST_STATES = -(-(2 * MOST_BODIES + DRIVE_STATES * MOST_DRIVES) // LANES) * LANES
MOST_INPUTS = MOST_DRIVES + MOST_BODIES

MACHINE = state(  # a machine: its matrices for one substep, its state, and what acts on it
    nq=int,  # positions, which come first in x, then as many speeds, then other states
    nx=int,
    nu=int,  # inputs, then nq forces
    ny=int,  # sensors
    nl=int,  # links: springs of elongation a q_i + b q_j between two coordinates, already part of A
    h=float,  # s, one substep
    t=float,  # s, since the start
    A=(float, (MOST_STATES, MOST_STATES)),
    G=(float, (MOST_STATES, MOST_INPUTS)),  # [B | E]
    Phi_T=(float, (MOST_STATES, MOST_STATES)),  # transposed: the inner loop runs along memory
    Gamma_T=(float, (MOST_INPUTS, MOST_STATES)),
    work=(float, (4, MOST_STATES + MOST_INPUTS, MOST_STATES + MOST_INPUTS)),
    volts=(float, MOST_DRIVES),  # at the input of each driver
    u=(float, MOST_DRIVES),  # inputs of the linear machine: volts, or commanded amperes
    y=(float, MOST_SENSORS),  # reading of each sensor before quantisation, SI
    y_rate=(float, MOST_SENSORS),  # rate of the reading of a position, else 0
    y_speed=(int, MOST_SENSORS),  # 1: the sensor shows a speed
    x=(float, MOST_STATES),
    x_next=(float, MOST_STATES),
    qm=(float, MOST_BODIES),  # positions and velocities at the middle of the substep
    vm=(float, MOST_BODIES),
    v_before=(float, MOST_BODIES),
    f=(float, MOST_BODIES),  # smooth force on each coordinate, N or Nm
    weight=(float, MOST_BODIES),  # part of `f` that is the weight of bodies
    push=(float, MOST_BODIES),  # with the dry friction of the last substep
    viscous=(float, MOST_BODIES),  # friction of each coordinate by its speed, part of A
    dry_base=(float, MOST_BODIES),
    dry=(float, MOST_BODIES),  # limit of the dry friction on each coordinate
    r=(float, MOST_BODIES),  # dry friction in force
    meant=int,  # 1: forces outside A and G act, so that accelerations are means of the last substep
    link_i=(int, MOST_LINKS),
    link_j=(int, MOST_LINKS),
    link_a=(float, MOST_LINKS),
    link_b=(float, MOST_LINKS),
    link_c=(float, MOST_LINKS),  # stiffness and damping of the linear spring
    link_k=(float, MOST_LINKS),
    link_T=(float, MOST_LINKS),  # pull of terms in addition to the linear spring, this substep
    link_e=(float, MOST_LINKS),  # elongation outside the linear model, as of tape wound at another radius
    link_v=(float, MOST_LINKS),  # rate of link_e
    inertia=(float, MOST_BODIES),  # of each coordinate, with which A and G were made, kg m^2 or kg
    reel_R=(float, MOST_REELS),  # m, present radius of the reel
    reel_J=(float, MOST_REELS),  # kg m^2, present inertia of the reel
    reel_R_lin=(float, MOST_REELS),  # m, the radius with which A was made
    reel_pull=(float, MOST_REELS),  # Nm, of all joints at the reel, at its radius
    reel_pull_lin=(float, MOST_REELS),  # Nm, of all joints at the reel in the linear model
)


@tick
def size(m, nq, nx, nu, ny, nl):
    """Set the numbers of coordinates, states, inputs, sensors and links."""
    m.nq, m.nx, m.nu, m.ny, m.nl = nq, nx, nu, ny, nl


def discretise(A: np.ndarray, G: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    """Transposed transition matrix (nx, nx) and input matrix (ninputs, nx) over `h` seconds."""
    nx, ng = G.shape
    Phi_T, Gamma_T = np.zeros((nx, nx)), np.zeros((ng, nx))
    work = np.zeros((4, nx + ng, nx + ng))
    discretise_into(np.ascontiguousarray(A, float), np.ascontiguousarray(G, float), nx, ng, h, Phi_T, Gamma_T, work)
    return Phi_T, Gamma_T


@tick
def discretise_into(A, G, nx, ng, h, Phi_T, Gamma_T, work):
    """As `discretise`, into given arrays of that size or larger ones; `work` is (4, n, n), n >= nx + ng."""
    n = nx + ng
    M, P, T, scale = work[0], work[1], work[2], work[3, 0]
    for i in range(n):
        for j in range(n):
            M[i, j] = 0.0
            P[i, j] = 1.0 if i == j else 0.0
    for i in range(nx):
        for j in range(nx):
            M[i, j] = A[i, j] * h
        for j in range(nx, n):
            M[i, j] = G[i, j - nx] * h
    _balance(M, scale, n)
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(M[i, j])
        norm = max(norm, row)
    if not norm < ENDLESS:  # of a model that has diverged: halving would never end
        Phi_T[:nx, :nx], Gamma_T[: n - nx, :nx] = np.nan, np.nan
        return
    squarings = 0
    while norm > 0.5:
        norm *= 0.5
        squarings += 1
    for i in range(n):
        for j in range(n):
            M[i, j] *= 0.5**squarings
    for k in range(TAYLOR, 0, -1):  # Horner: I + M (I + M/2 (I + M/3 (...)))
        _multiply(M, P, 1.0 / k, T, n)
        for i in range(n):
            for j in range(n):
                P[i, j] = T[i, j] + (1.0 if i == j else 0.0)
    for _ in range(squarings):
        _multiply(P, P, 1.0, T, n)
        for i in range(n):
            for j in range(n):
                P[i, j] = T[i, j]
    for i in range(nx):
        for j in range(nx):
            Phi_T[j, i] = P[i, j] * scale[i] / scale[j]
        for j in range(nx, n):
            Gamma_T[j - nx, i] = P[i, j] * scale[i] / scale[j]


@tick
def _balance(M, scale, n):
    """Scale rows and columns by powers of two until they are alike: positions and velocities differ by 1e4.

    Without balancing, the stiffest spring determines the scaling of the exponential, and the rounding of twenty
    squarings makes the rigid rotation, whose eigenvalue is exactly one, drift.

    Source: Parlett & Reinsch, Numer. Math. 13 (1969).
    """
    for i in range(n):
        scale[i] = 1.0
    for _ in range(BALANCE_SWEEPS):
        for i in range(n):
            column = 0.0
            row = 0.0
            for j in range(n):
                if j != i:
                    column += abs(M[j, i])
                    row += abs(M[i, j])
            if column == 0.0 or row == 0.0:
                continue
            factor = 1.0
            while column * factor * 2.0 < row / factor:
                factor *= 2.0
            while column * factor > row / factor * 2.0:
                factor *= 0.5
            if factor != 1.0:
                scale[i] *= factor
                for j in range(n):
                    M[i, j] /= factor
                for j in range(n):
                    M[j, i] *= factor


@tick
def _multiply(L, R, factor, out, n):
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
        for k in range(n):
            a = L[i, k] * factor
            if a != 0.0:
                for j in range(n):
                    out[i, j] += a * R[k, j]


@tick
def discretise_machine(m):
    """Transition of a machine over its substep, from its A and G."""
    discretise_into(m.A, m.G, m.nx, m.nu + m.nq, m.h, m.Phi_T, m.Gamma_T, m.work)


@tick
def midpoint(m):
    """Extrapolate positions and velocities to the middle of the coming substep and clear the forces."""
    nq = m.nq
    for i in range(nq):
        v = m.x[nq + i]
        m.vm[i] = 1.5 * v - 0.5 * m.v_before[i]
        m.qm[i] = m.x[i] + 0.5 * m.h * (1.25 * v - 0.25 * m.v_before[i])
        m.v_before[i] = v
        m.f[i] = 0.0
        m.dry[i] = m.dry_base[i]
    for j in range(m.nl):
        m.link_T[j] = 0.0
        m.link_e[j] = 0.0
        m.link_v[j] = 0.0


@tick
def acceleration(m, i):
    """Acceleration of coordinate `i` at the end of the last substep, by the forces there; a mean would be delayed."""
    if m.t == 0.0:
        return 0.0
    at = m.nq + i
    if m.meant == 1:
        return (m.x[at] - m.v_before[i]) / m.h
    total = m.G[at, m.nu + i] * (m.f[i] + m.r[i])
    for k in range(m.nx):
        total += m.A[at, k] * m.x[k]
    for d in range(m.nu):
        total += m.G[at, d] * m.u[d]
    return total


@tick
def link(m, j, i1, a, i2, b, c, k):
    """Set link `j` as the spring of stiffness c and damping k with elongation a q_i1 + b q_i2."""
    m.link_i[j], m.link_j[j] = i1, i2
    m.link_a[j], m.link_b[j], m.link_c[j], m.link_k[j] = a, b, c, k


@tick
def side(m, j, i):
    """Sign of the elongation of link `j` with coordinate `i`, at one of its ends: 1 longer, -1 shorter."""
    return 1.0 if (m.link_a[j] if m.link_i[j] == i else m.link_b[j]) > 0.0 else -1.0


@tick
def stretch(m, j):
    """Elongation of link `j` at the middle of the substep, m or rad."""
    return m.link_a[j] * m.qm[m.link_i[j]] + m.link_b[j] * m.qm[m.link_j[j]] + m.link_e[j]


@tick
def stretch_rate(m, j):
    """Rate of elongation of link `j` at the middle of the substep, m/s or rad/s."""
    return m.link_a[j] * m.vm[m.link_i[j]] + m.link_b[j] * m.vm[m.link_j[j]] + m.link_v[j]


@tick
def known(m, j):
    """Pull of the linear model alone in link `j` at the middle of the substep, N or Nm."""
    e, v = stretch(m, j) - m.link_e[j], stretch_rate(m, j) - m.link_v[j]
    return m.link_c[j] * e + m.link_k[j] * v


@tick
def tension(m, j):
    """Pull in link `j` at the middle of the substep, of spring, damper and the terms so far, N or Nm."""
    return m.link_c[j] * stretch(m, j) + m.link_k[j] * stretch_rate(m, j) + m.link_T[j]


@tick
def pull(m, j, T):
    """Add a pull of `T` N or Nm in link `j` to the forces at its two ends."""
    m.f[m.link_i[j]] -= m.link_a[j] * T
    m.f[m.link_j[j]] -= m.link_b[j] * T
    m.link_T[j] += T


@tick
def extend(m, j, e, v):
    """Extend link `j` by `e` m or rad, growing at the rate `v`. Its spring and damper act on the extension, and
    `stretch` includes it."""
    T = m.link_c[j] * e + m.link_k[j] * v
    m.f[m.link_i[j]] -= m.link_a[j] * T
    m.f[m.link_j[j]] -= m.link_b[j] * T
    m.link_e[j] += e
    m.link_v[j] += v


@tick
def slid(m, j, d, v, T):
    """Slide link `j` by `d` m or rad in total, at the rate `v`, which changes its pull by `T`. `stretch` includes the
    slip, as it includes the extension of `extend`."""
    pull(m, j, T)
    m.link_e[j] -= d
    m.link_v[j] -= v
    m.link_T[j] += m.link_c[j] * d + m.link_k[j] * v


@tick
def advance(m):
    """One substep with the inputs `m.u` and the smooth forces `m.f` held; dry friction `m.dry` closes it."""
    nx, nu, nq = m.nx, m.nu, m.nq
    m.t += m.h
    dry_nodes, last = 0, 0
    for j in range(nq):
        if m.dry[j] > 0.0:
            dry_nodes += 1
            last = j
        else:
            m.r[j] = 0.0
        m.push[j] = m.f[j] + m.r[j]  # the last reaction is the warm start
    sum_rows(m.x_next, nx, m.Phi_T, m.x, nx, m.Gamma_T, m.u, nu, m.push, nq)
    if dry_nodes == 1:  # exact without sweeps
        change = _reaction(m, last)
        if change != 0.0:
            for i in range(nx):
                m.x[i] = m.x_next[i] + m.Gamma_T[nu + last, i] * change
            return
    elif dry_nodes > 1:
        _gauss_seidel(m)
    for i in range(nx):
        m.x[i] = m.x_next[i]


@tick
def _gauss_seidel(m):
    """Dry friction at several coordinates, into x_next."""
    for _ in range(SWEEPS):
        settled = True
        for j in range(m.nq):
            if m.dry[j] > 0.0:
                change = _reaction(m, j)
                if change != 0.0:
                    settled = False
                    for i in range(m.nx):
                        m.x_next[i] += m.Gamma_T[m.nu + j, i] * change
        if settled:  # converged, as for sliding coordinates
            break


@tick
def _reaction(m, j):
    """Dry friction at coordinate `j` into r; returns its change."""
    gain, before = m.Gamma_T[m.nu + j, m.nq + j], m.r[j]
    r = dry_friction(m.x[m.nq + j], m.x_next[m.nq + j] - gain * before, gain, m.dry[j])
    m.r[j] = r
    return r - before


@tick
def dry_friction(v, v_free, gain, limit):
    """Mean dry friction over a substep that starts at speed `v` and would end at `v_free` without it.

    `gain` is the speed that a unit force held over the substep adds. While the node slides, the friction is the limit.
    Where the node would reverse within the substep, the time of the reversal is found, so that the speed after it has
    second order. Where the limit suffices to hold the node, the friction is the holding force.
    """
    push = v_free - v
    if v == 0.0:
        if abs(push) <= gain * limit:
            return -push / gain
        return -limit if push > 0.0 else limit
    s = 1.0 if v > 0.0 else -1.0
    change = push - s * gain * limit
    if s * (v + change) >= 0.0:
        return -s * limit
    if abs(push) <= gain * limit:
        return -v_free / gain
    share = -v / change  # of the substep, before the turn
    return s * limit * (1.0 - 2.0 * share)
