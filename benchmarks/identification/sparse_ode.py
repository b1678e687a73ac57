"""PySINDy: sparse regression of the acceleration on a library of terms, and free run of the equation."""

import numpy as np
import pysindy as ps

from identification.records import Problem

SUBSTEPS = 4
LEVELS = (
    0.0,
    0.01,
    0.03,
    0.1,
)  # thresholds of a term's share of the acceleration; the best one on the last fitted rows is used


def fit(p: Problem) -> tuple[np.ndarray, dict[str, float]]:
    """Free run (n - first,) over the rows to predict, and the equation as numbers by term."""
    states = p.states
    x, v, u = states[: p.first, 0], states[: p.first, 1], p.force[: p.first]
    top, scale = float(np.max(np.abs(v))), float(np.std(p.force)) or 1.0
    names = ("1", "u", "v", "x", "sin x", "cos x", "tanh v", "|v| v", "x^3", "|u| tanh v")

    def library(z: np.ndarray) -> np.ndarray:
        a, b, c = z[..., 0], z[..., 1], z[..., 2]
        t = np.tanh(b / (0.02 * top))
        columns = [
            np.ones_like(a),
            c / scale,
            b / top,
            a,
            np.sin(a),
            np.cos(a),
            t,
            np.abs(b) * b / top**2,
            a**3,
            np.abs(c) / scale * t,
        ]
        return np.stack(columns, axis=-1)

    derivative = np.gradient(v, p.dt)
    table = library(np.stack([x, v, u], axis=1))
    cut = round(0.8 * p.first)
    best: tuple[float, np.ndarray] | None = None
    for level in LEVELS:
        stlsq = ps.STLSQ(threshold=level * float(np.std(derivative)), alpha=1e-6, normalize_columns=False)
        stlsq.fit(table[:cut], derivative[:cut])
        w = np.asarray(stlsq.coef_).ravel()
        free = run(library, w, states[cut], p.force[cut : p.first], p.dt)[:, 1 if p.shows_speed else 0]
        e = float(np.mean((free - p.seen[cut : p.first]) ** 2))
        if best is None or (np.isfinite(e) and e < best[0]):
            best = (e if np.isfinite(e) else np.inf, w)
    assert best is not None
    free = run(library, best[1], states[p.first], p.force[p.first :], p.dt)[:, 1 if p.shows_speed else 0]
    return free, {name: float(w) for name, w in zip(names, best[1], strict=True) if w != 0.0}


def run(library, w: np.ndarray, state: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
    """States (n, 2) of the equation from an initial state."""
    out = np.empty((len(force), 2))
    x, v = float(state[0]), float(state[1])
    h = dt / SUBSTEPS
    for k, u in enumerate(force):
        out[k] = x, v
        if not abs(x) < 1e6:
            out[k:] = np.nan
            break
        for _ in range(SUBSTEPS):
            v += h * float(library(np.array([x, v, u])) @ w)
            x += h * v
    return out
