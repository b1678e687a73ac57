"""CMA-ES fit of a rigid body with one fixed friction model by simulation of the recording.

As PACE and BAM fit robots' joints: viscous friction, dry friction with Stribeck's peak, and friction in proportion to
the load; inertia, weight and an offset. Simulated from smoothed states in windows of half a second.
"""

import cma
import numba
import numpy as np

from identification.records import Problem

SECONDS = 0.5  # s, length of a window
EVALUATIONS = 4000
NAMES = ("inertia", "viscous", "dry", "stribeck", "stribeck_speed", "load", "weight", "offset")


@numba.njit(cache=True)
def path(force, dt, x, v, q, weight):
    """Positions and speeds (n, 2) from a state, with 4 substeps a row. q: as NAMES."""
    out = np.empty((len(force), 2))
    h = dt / 4
    for k in range(len(force)):
        out[k, 0], out[k, 1] = x, v
        for _ in range(4):
            pull = weight * q[6] * np.sin(x)
            total = force[k] - pull - q[7]
            limit = q[2] + q[3] * np.exp(-abs(v) / q[4]) + q[5] * abs(total)
            free = v + h * (total - q[1] * v) / q[0]
            stop = h * limit / q[0]
            v = free - stop if free > stop else free + stop if free < -stop else 0.0
            x += h * v
    return out


@numba.njit(cache=True)
def windows_error(force, seen, column, states, dt, length, q, weight, every):
    """Mean square error over windows of `length` rows."""
    total, count = 0.0, 0
    for begin in range(0, len(force) - length, length * every):
        out = path(force[begin : begin + length], dt, states[begin, 0], states[begin, 1], q, weight)
        for k in range(length):
            e = out[k, column] - seen[begin + k]
            total += e * e
            count += 1
    return total / count


def fit(p: Problem) -> tuple[np.ndarray, dict[str, float]]:
    """Free run (n - first,) over the rows to predict, and the numbers that were found."""
    o, states = p.owner, p.states
    scale, top = float(np.std(p.force)) or 1.0, float(np.max(np.abs(states[:, 1])))
    length = max(20, round(SECONDS / p.dt))
    every = max(1, p.first // (40 * length))
    column = 1 if p.shows_speed else 0
    known = o.viscous or 0.05 * scale / top

    def numbers(z: np.ndarray) -> np.ndarray:
        z = np.clip(z, -6.0, 6.0)
        return np.array([
            o.inertia * np.exp(0.5 * z[0]), known * np.exp(z[1]), 0.05 * scale * np.exp(z[2]),
            0.02 * scale * np.exp(z[3]), 0.05 * top * np.exp(z[4]), 0.02 * np.exp(z[5]), np.exp(0.3 * z[6]),
            0.1 * scale * z[7],
        ])  # fmt: skip

    def cost(z: np.ndarray) -> float:
        q = numbers(z)
        e = windows_error(p.force[: p.first], p.seen[: p.first], column, states, p.dt, length, q, o.weight, every)
        return float(e / p.spread**2) if np.isfinite(e) else 1e9

    best, _ = cma.fmin2(cost, np.zeros(len(NAMES)), 1.0, {"maxfevals": EVALUATIONS, "verbose": -9, "seed": 1})
    q = numbers(best)
    free = path(p.force[p.first :], p.dt, states[p.first, 0], states[p.first, 1], q, o.weight)[:, column]
    return free, dict(zip(NAMES, (float(v) for v in q), strict=True)) | {"weight": o.weight * float(q[6])}
