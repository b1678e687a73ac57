"""Coupled mechanics around a graph of single coordinates: integration of M(q) q'' + h(q, v) = F.

    (diag(J) + sum_kl a_k a_l M_kl(q)) q'' + sum_k a_k h_k(q, v) = F(q, v, x, u) + f + r

J are the inertias of bodies beside those of the mechanics file, M and h are the file's, a the ratios of rigid joints,
F what springs, dampers and drives put on the coordinates, f the terms, and r the dry friction. Fourth-order
Runge-Kutta steps advance positions, speeds and the states of drives; f and r are held over a substep. Dry friction
closes the speeds at its end by Gauss-Seidel with the mobility h M(q)^-1 at its middle, so that friction at one
coordinate reaches the others through M, and a coordinate that sticks stands exactly still.

Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I (1993), II.1; Moreau-Jean time stepping
(Acary & Brogliato 2008, ch. 10) for the friction.
"""

import math
import traceback
import warnings
from collections import namedtuple
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numba.core.errors import NumbaExperimentalFeatureWarning

from rtctl.idiom import interpreted, tick
from rtctl.plants import linear
from rtctl.plants.graph import params as graph_params
from rtctl.plants.graph import plant
from rtctl.plants.graph.layout import NOWHERE, Layout
from rtctl.plants.graph.mechanics import Mechanics, bodies_of, code_of
from rtctl.plants.graph.params import POSITION, GraphParams, Q

# params with the mechanics' own fields replace the general params
warnings.filterwarnings("ignore", message=".*considered a subtype.*", category=NumbaExperimentalFeatureWarning)

REACH = 0.35  # rad, largest eigenvalue times a step: Runge-Kutta's phase error is then 1e-4 for each radian
MOST_INNER = 400  # steps a substep
SWEEPS = 30  # of Gauss-Seidel: friction of one coordinate reaches another within the substep
SETTLED = 1e-9  # of the limit, change of a reaction that ends the sweeps
SMALL = 1e-5  # rad or m (and per s), step of the differences that linearise h


class Coupled(NamedTuple):
    """Parameters of the mechanics of a plant. A coordinate k of the file is a[k] q[i[k]]."""

    n: int
    inner: int  # Runge-Kutta steps a substep
    i: np.ndarray  # (Q,)
    a: np.ndarray  # (Q,)
    J: np.ndarray  # (n,) inertias or masses of its bodies, as the description has them
    base: np.ndarray  # (Q,) inertia of all other bodies by coordinate of the machine
    q0: np.ndarray  # (Q,) position of each coordinate of the machine at the start
    p: Any  # params of the file


def params_class(name: str) -> type:
    """Params of a plant with mechanics: those of every machine, and `coupled`; who registers it sets its `code`."""
    return type(f"{name}GraphParams", (namedtuple("Params", (*GraphParams._fields, "coupled")),), {})


def machine_params(layout: Layout, values: dict[str, float], h: float) -> Any:
    """Params of any machine for substeps of `h` s; with `coupled` where a file gives its mechanics.

    The inertia of a coordinate is then 1 / (M^-1)_ii at the start. Raises ValueError where M is not positive definite.
    """
    p = graph_params.build(layout, values, h)
    code = code_of(layout.machine)
    if code is None:
        return p
    parameters = {
        path.removeprefix("mechanics.parameters."): value
        for path, value in values.items()
        if path.startswith("mechanics.parameters.")
    }
    names = bodies_of(layout.machine)
    i, a, J, base = np.zeros(Q, np.int64), np.zeros(Q), np.zeros(len(names)), p.inertia.copy()
    for k, name in enumerate(names):
        key = "inertia" if layout.machine.bodies[name].turns else "mass"
        i[k], a[k] = layout.coordinate(name), layout.ratio(name, values)
        J[k] = values[f"bodies.{name}.{key}"]
        base[i[k]] -= a[k] ** 2 * J[k]
    q0 = np.zeros(Q)
    for name, at in layout.machine.mechanics.at.items():  # type: ignore[union-attr, unused-ignore]
        place = layout.bodies[name]
        if place.coordinate != NOWHERE:
            q0[place.coordinate] = at / layout.ratio(name, values)
    given = code.module.build(code.settings.model_validate(parameters), h)
    c = Coupled(len(names), 1, i, a, J, np.maximum(base, 0.0), q0, given)
    M, _ = at_start(code, p, c)
    ok = np.isfinite(M).all() and (np.linalg.eigvalsh(M) > 0.0).all()
    if not ok:
        raise ValueError(
            f"mechanics.parameters: M of {code.name} is not positive definite at the start; look at its numbers and at "
            "the inertias of its bodies"
        )
    inertia = p.inertia.copy()
    inertia[: p.nq] = 1.0 / np.diag(np.linalg.inv(M))
    made = code.params(*p._replace(inertia=inertia), coupled=c)
    A, _ = linearised(code, made)
    fastest = float(np.abs(np.linalg.eigvals(A)).max(initial=0.0))
    inner = int(np.clip(math.ceil(h * fastest / REACH), 1, MOST_INNER)) if np.isfinite(fastest) else MOST_INNER
    return made._replace(coupled=c._replace(inner=inner))


def at_start(code: Mechanics, p: Any, c: Coupled, dq: Any = None, v: Any = None) -> tuple[np.ndarray, np.ndarray]:
    """M (nq, nq) and h (nq,) by coordinates of the machine, at the start plus `dq`, at speeds `v`; zero if absent."""
    q = c.q0[: p.nq] + (0.0 if dq is None else dq)
    v = np.zeros(p.nq) if v is None else v
    i, a, n = c.i[: c.n], c.a[: c.n], c.n
    own, h = np.zeros((n, n)), np.zeros(n)
    try:
        with interpreted():
            code.module.M(c.p, c.J, a * q[i], own)
            code.module.h(c.p, c.J, a * q[i], a * v[i], h)
    except Exception as error:  # a user's file may raise any exception
        frames = traceback.extract_tb(error.__traceback__)
        line = next((f":{f.lineno}" for f in reversed(frames) if f.filename == code.module.__file__), "")
        raise ValueError(f"mechanics.kind: {code.module.__file__}{line}: {type(error).__name__}: {error}") from error
    M, H = np.diag(c.base[: p.nq]), np.zeros(p.nq)
    for k in range(n):
        H[i[k]] += a[k] * h[k]
        for j in range(n):
            M[i[k], i[j]] += a[k] * a[j] * own[k, j]
    return M, H


def felt(layout: Layout, values: dict[str, float]) -> list[str]:
    """Bodies of the mechanics whose position M or h depends on."""
    code = code_of(layout.machine)
    if code is None:
        return []
    p = machine_params(layout, values, 1e-3)
    out = []
    for k, name in enumerate(bodies_of(layout.machine)):
        moved = np.zeros(p.nq)
        moved[p.coupled.i[k]] = 0.5
        one, two = at_start(code, p, p.coupled, v=np.ones(p.nq)), at_start(code, p, p.coupled, moved, np.ones(p.nq))
        if any(not np.allclose(x, y, rtol=1e-9, atol=1e-15) for x, y in zip(one, two, strict=True)):
            out.append(name)
    return out


def pulled(layout: Layout, values: dict[str, float]) -> list[str]:
    """Bodies of the mechanics with a force h at rest, at the start or near it."""
    code = code_of(layout.machine)
    if code is None:
        return []
    p = machine_params(layout, values, 1e-3)
    out = []
    for k, name in enumerate(bodies_of(layout.machine)):
        i = int(p.coupled.i[k])
        forces = [at_start(code, p, p.coupled, dq=d * np.eye(p.nq)[i])[1][i] for d in (0.0, SMALL)]
        if any(forces):
            out.append(name)
    return out


def linearised(code: Mechanics, p: Any) -> tuple[np.ndarray, np.ndarray]:
    """A (nx, nx) and B (nx, nu) about the start, without weight of bodies and dry friction."""
    A, B = plant.state_space(p)
    c, nq = p.coupled, p.nq
    M, _ = at_start(code, p, c)
    K, C = np.zeros((nq, nq)), np.zeros((nq, nq))
    for j in range(nq):
        d = SMALL * np.eye(nq)[j]
        K[:, j] = (at_start(code, p, c, dq=d)[1] - at_start(code, p, c, dq=-d)[1]) / (2 * SMALL)
        C[:, j] = (at_start(code, p, c, v=d)[1] - at_start(code, p, c, v=-d)[1]) / (2 * SMALL)
    inverse = np.linalg.inv(M)
    take = inverse @ np.diag(p.inertia[:nq])
    A[nq : 2 * nq] = take @ A[nq : 2 * nq]
    B[nq : 2 * nq] = take @ B[nq : 2 * nq]
    A[nq : 2 * nq, :nq] -= inverse @ K
    A[nq : 2 * nq, nq : 2 * nq] -= inverse @ C
    return A, B


@tick
def place(p, m):
    """Positions at the start; speeds are zero."""
    for i in range(p.nq):
        m.x[i] = p.coupled.q0[i]


@tick
def zero(p, m):
    """Let sensors of a position show 0 where the machine starts."""
    q0 = p.coupled.q0
    for c in range(p.ny):
        if p.sensor_kind[c] == POSITION:
            m.y[c] -= p.sensor_a[c] * q0[p.sensor_i[c]] + p.sensor_b[c] * q0[p.sensor_j[c]]


@tick
def loads(p, m, x, b):
    """Force on each coordinate by the linear model in state x (nx,), and m.push, into b (nq,), N or Nm."""
    nq, nu, nx = p.nq, p.nu, p.nx
    for i in range(nq):
        total = 0.0
        for j in range(nx):
            total += m.A[nq + i, j] * x[j]
        for j in range(nu):
            total += m.G[nq + i, j] * m.u[j]
        b[i] = m.inertia[i] * total + m.push[i]


@tick
def drive_rates(p, m, x, out):
    """Rates of the states of drives in state x (nx,), into out (nx,)."""
    nq, nu, nx = p.nq, p.nu, p.nx
    for i in range(2 * nq, nx):
        total = 0.0
        for j in range(nx):
            total += m.A[i, j] * x[j]
        for j in range(nu):
            total += m.G[i, j] * m.u[j]
        out[i] = total


@tick
def factor(L, n):
    """Cholesky factor of a symmetric matrix, in its lower half."""
    for j in range(n):
        for i in range(j, n):
            total = L[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = math.sqrt(total) if i == j else total / L[j, j]


@tick
def solve(L, b, n):
    """Solution of L L^T x = b, in the place of b (n,)."""
    for i in range(n):
        for k in range(i):
            b[i] -= L[i, k] * b[k]
        b[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= L[k, i] * b[k]
        b[i] /= L[i, i]


@tick
def close(p, m, mobility):
    """Dry friction into x_next, by the speeds (nq, nq) that a unit force at each coordinate adds in a substep."""
    nq = p.nq
    for _ in range(SWEEPS):
        settled = True
        for j in range(nq):
            if m.dry[j] <= 0.0:
                continue
            gain, before = mobility[j, j], m.r[j]
            r = linear.dry_friction(m.x[nq + j], m.x_next[nq + j] - gain * before, gain, m.dry[j])
            change = r - before
            if abs(change) > SETTLED * m.dry[j]:
                settled = False
            m.r[j] = r
            for i in range(nq):
                m.x_next[nq + i] += mobility[j, i] * change
                m.x_next[i] += 0.5 * m.h * mobility[j, i] * change
        if settled:
            break
    for j in range(nq):
        if m.dry[j] > 0.0 and abs(m.r[j]) < m.dry[j]:
            held = abs(m.x_next[nq + j]) <= 1e-6 * mobility[j, j] * m.dry[j]
            if held:
                m.x_next[nq + j] = 0.0
                if m.x[nq + j] == 0.0:
                    m.x_next[j] = m.x[j]


def steps(mechanics: Any, name: str) -> ModuleType:
    """Module `name` with the compiled integration around M and h of a module: `place`, `zero`, `advance`, `play`."""
    M_of, h_of = mechanics.M, mechanics.h

    def kept(function: Any) -> Any:  # on disk, under the hash of the file's text that is part of `name`
        function.__module__, function.kept = name, True
        return tick(function)

    @kept
    def couple(p, m, x, what):
        """Matrix of the machine's inertia into work[1], and h by coordinates into work[2, 4], in state x; the positions
        alone where `what` is 0."""
        c, W = p.coupled, m.work
        nq, n = p.nq, c.n
        own, full, q, v, h = W[0], W[1], W[2, 5], W[2, 6], W[2, 7]
        for k in range(n):
            for j in range(n):
                own[k, j] = 0.0
            q[k] = c.a[k] * x[c.i[k]]
            v[k] = c.a[k] * x[nq + c.i[k]]
            h[k] = 0.0
        M_of(c.p, c.J, q, own)
        for i in range(nq):
            for j in range(nq):
                full[i, j] = 0.0
            full[i, i] = c.base[i]
            W[2, 4, i] = 0.0
        for k in range(n):
            for j in range(n):
                full[c.i[k], c.i[j]] += c.a[k] * c.a[j] * own[k, j]
        if what != 0:
            h_of(c.p, c.J, q, v, h)
            for k in range(n):
                W[2, 4, c.i[k]] += c.a[k] * h[k]

    @kept
    def rates(p, m, x, out):
        """Rates of the state x (nx,) into out (nx,)."""
        nq, W = p.nq, m.work
        couple(p, m, x, 1)
        b = W[2, 8]
        loads(p, m, x, b)
        for i in range(nq):
            b[i] -= W[2, 4, i]
        factor(W[1], nq)
        solve(W[1], b, nq)
        for i in range(nq):
            out[i] = x[nq + i]
            out[nq + i] = b[i]
        drive_rates(p, m, x, out)

    @kept
    def integrate(p, m):
        """x_next after a substep under m.u and m.push."""
        W, nx = m.work, p.nx
        x, total, rate, stage = m.x_next, W[2, 0], W[2, 1], W[2, 2]
        h = p.h / p.coupled.inner
        for i in range(nx):
            x[i] = m.x[i]
        for _ in range(p.coupled.inner):
            for i in range(nx):
                stage[i] = x[i]
                total[i] = 0.0
            for k in range(4):
                rates(p, m, stage, rate)
                weight = 1.0 / 6.0 if k == 0 or k == 3 else 1.0 / 3.0
                ahead = h if k == 2 else 0.5 * h
                for i in range(nx):
                    total[i] += weight * rate[i]
                    stage[i] = x[i] + ahead * rate[i]
            for i in range(nx):
                x[i] += h * total[i]

    @kept
    def advance(p, m):
        """One substep with the inputs m.u and the smooth forces m.f held; dry friction m.dry closes it."""
        nq, W = p.nq, m.work
        m.t += p.h
        m.meant = 1
        dry = 0
        for j in range(nq):
            if m.dry[j] > 0.0:
                dry += 1
            else:
                m.r[j] = 0.0
            m.push[j] = m.f[j] + m.r[j]
        integrate(p, m)
        if dry > 0:
            middle = W[2, 3]
            for i in range(nq):
                middle[i] = 0.5 * (m.x[i] + m.x_next[i])
                middle[nq + i] = 0.0
            couple(p, m, middle, 0)
            factor(W[1], nq)
            for j in range(nq):
                for i in range(nq):
                    W[3, j, i] = p.h if i == j else 0.0
                solve(W[1], W[3, j], nq)
            close(p, m, W[3])
        for i in range(p.nx):
            m.x[i] = m.x_next[i]

    @kept
    def play(p, s, u, substeps, y):
        """As played.play, of a machine with these mechanics."""
        m = s.m
        plant.start(p, s)
        place(p, m)
        for k in range(len(u)):
            plant.read(p, m)
            zero(p, m)
            for c in range(p.ny):
                y[k, c] = m.y[c]
            for d in range(p.nu):
                m.volts[d] = u[k, d]
            for _ in range(substeps):
                plant.ask(p, m)
                plant.take(p, m)
                linear.midpoint(m)
                plant.weigh(p, m)
                advance(p, m)

    made = ModuleType(name)
    vars(made).update(advance=advance, place=place, zero=zero, play=play)
    return made
