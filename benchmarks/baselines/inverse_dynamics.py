"""Inverse dynamics: regression on effort, the nominal model, and regressors by forward selection with BIC.

The acceleration is the dependent variable, since it has the noise: as dependent variable, the effort would be explained
by any function of the effort.

The library has the usual regressors with their effect names. A shape parameter (a speed, a band, a position) is tried
on a grid and counts as one parameter.

Source: Gautier (1997) for the regression; Schwarz, Annals of Statistics 6 (1978) for BIC.
"""

from typing import Any, NamedTuple

import numpy as np

from baselines.form import diagnosis
from baselines.states import States, states
from rtctl.diagnose.record.format1 import Record

MOST = 3  # most effects
GAIN = 10.0  # least decrease of BIC: very strong evidence (Kass & Raftery 1995)


class Regressor(NamedTuple):
    """Columns (n, k) for one effect; `name` is empty for a form that has no name in the exchange format."""

    name: str
    X: np.ndarray
    shapes: int = 0  # number of grid parameters


def bic(rss: float, n: int, k: int) -> float:
    """Bayesian information criterion for k parameters and Gaussian errors."""
    return float(n * np.log(max(rss, 1e-300) / n) + k * np.log(n))


def residual(X: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Residual (n,) of y after projection on the columns of X, independent of their scale."""
    X = X / np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    found: np.ndarray = y - X @ np.linalg.lstsq(X, y, rcond=1e-10)[0]
    return found


def forward(y: np.ndarray, base: np.ndarray, library: list[Regressor], most: int = MOST) -> list[Regressor]:
    """Forward selection: regressors by decreasing effect on BIC, while BIC falls by more than GAIN."""
    chosen: list[Regressor] = []
    X, shapes = base, 0
    e = residual(X, y)
    best = bic(float(e @ e), len(y), X.shape[1])
    while len(chosen) < most:
        scored = []
        for i, r in enumerate(library):
            if any(r.name == c.name and r.X.shape == c.X.shape and (r.X == c.X).all() for c in chosen):
                continue
            both = np.column_stack((X, r.X))
            e = residual(both, y)
            scored.append((bic(float(e @ e), len(y), both.shape[1] + shapes + r.shapes), i))
        if not scored or min(scored)[0] > best - GAIN:
            break
        best, i = min(scored)
        chosen.append(library[i])
        X, shapes = np.column_stack((X, library[i].X)), shapes + library[i].shapes
    return chosen


def base_columns(s: States) -> np.ndarray:
    """Columns (n, k) of the nominal model: effort over inertia, friction and spring where described."""
    columns = [s.effort]
    if s.has_viscous:
        columns.append(s.v)
    if s.has_coulomb:
        columns.append(np.sign(s.v))
    if s.has_spring:
        columns.append(s.x)
    return np.column_stack(columns)


def play(x: np.ndarray, width: float) -> np.ndarray:
    """Output (n,) of the play operator with `width`: it follows x at most half the width away."""
    out = np.empty_like(x)
    z = x[0]
    for k, now in enumerate(x):
        z = min(max(z, now - 0.5 * width), now + 0.5 * width)
        out[k] = z
    return out


def regressors(s: States) -> list[Regressor]:
    """Regressor library for one recording."""
    one, dry, fast = np.ones_like(s.v), np.sign(s.v), float(np.sqrt(np.mean(s.v**2))) + 1e-300
    top, span = float(np.abs(s.u).max()) + 1e-300, float(np.ptp(s.x)) + 1e-300
    effort = s.effort
    out = [
        Regressor("drive.offset", one[:, None]),
        Regressor("drive.gain_asymmetry", np.abs(effort)[:, None]),
        Regressor("friction.asymmetry", np.abs(s.v)[:, None]),
        Regressor("friction.load", (s.pull * dry)[:, None]),
        Regressor("drive.thermal", (effort * s.t)[:, None]),
        Regressor("timing.delay", (s.earlier - effort)[:, None]),  # nearly a lag after the smoothing
        Regressor("", (s.v * np.abs(s.v))[:, None]),
        Regressor("", (s.x**2)[:, None]),
    ]
    if s.reels:
        out += [
            Regressor("drive.supply_sag", (effort * s.pull)[:, None]),
            Regressor("geometry.radius_change", (s.x * effort)[:, None]),
        ]
    if not s.has_spring:
        out.append(Regressor("load.spring", s.x[:, None]))
    if not s.has_coulomb:
        out.append(Regressor("friction.coulomb", dry[:, None]))
    if not s.has_viscous:
        out.append(Regressor("friction.viscous", s.v[:, None]))
    for share in (0.03, 0.1, 0.3):
        out.append(Regressor("friction.stribeck", (dry * np.exp(-((s.v / (share * fast)) ** 2)))[:, None], 1))
    for share in (0.01, 0.03, 0.1):
        out.append(Regressor("drive.deadband", np.clip(s.u, -share * top, share * top)[:, None], 1))
        width = share * share * span
        out.append(Regressor("friction.presliding", (s.x - play(s.x, width))[:, None] / width - 0.5 * dry[:, None], 1))
        out.append(Regressor("transmission.backlash", (play(s.x, width) - s.x)[:, None] * np.abs(dry)[:, None], 1))
    for share in (0.5, 0.7, 0.9):
        beyond = s.u - np.clip(s.u, -share * top, share * top)
        out.append(Regressor("drive.saturation", beyond[:, None], 1))
    out.append(Regressor("drive.lag", s.slope[:, None]))
    for name, angle in (("ripple.cogging", s.motor), ("load.imbalance", s.capstan), ("ripple.reel", s.motor)):
        if angle is None or (name == "ripple.reel" and not s.reels):
            continue
        orders = (4, 6, 7, 8, 10, 12, 14) if name == "ripple.cogging" else (1,)
        lever = effort if name == "ripple.reel" else one
        for k in orders:
            waves = np.column_stack((np.cos(k * angle), np.sin(k * angle))) * lever[:, None]
            out.append(Regressor(name, waves, int(len(orders) > 1)))
    for place in np.linspace(s.x.min(), s.x.max(), 14)[1:-1]:
        out.append(Regressor("load.bump", np.exp(-(((s.x - place) / (0.04 * span)) ** 2))[:, None], 2))
    return out


def diagnose(record: Record) -> dict[str, Any]:
    """Diagnosis with the names of the regressors selected by BIC."""
    s = states(record)
    chosen = forward(s.a, base_columns(s), regressors(s))
    names = list(dict.fromkeys(r.name for r in chosen if r.name))
    return diagnosis(record.plant, names, unnamed=bool(chosen))
