"""Fit of the Stribeck curve to friction at several speeds, with only the parameters that the points determine.

    F(v) = F_C + (F_S - F_C) exp(-(v / v_s)^2) + F_v v                                                        (8.3)

For a given v_s the curve is linear in the other parameters. v_s is searched on a grid, then between grid points.

Source: thesis (8.3); Armstrong-Helouvry 1994.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer

CHANCE = 1e-3  # p-value below which a fall of the friction with speed is significant


class Stribeck(NamedTuple):
    """Fit of (8.3) in the unit of the points, with half widths of 95 % intervals; None where undetermined."""

    F_C: float
    F_S: float | None
    v_s: float | None  # rad/s
    F_v: float  # per rad/s
    F_C_half: float
    F_S_half: float | None
    v_s_half: float | None
    F_v_half: float


def stribeck(v: Sequence[float], F: Sequence[float], resolution: float = 0.02, fall: bool = True) -> Stribeck:
    """Fit (8.3) through friction `F` at speeds `v` >= 0 (both (n,)), by least squares over all v_s.

    F_S and v_s are None where the points show no fall: it is less than `resolution` of F_C, less than its interval, or
    no better a fit than a straight line. v_s alone is None where the fall lies between standstill and the slowest
    speed. Without `fall` neither is fitted. Raises NoAnswer for fewer than 3 different speeds.
    """
    from scipy.optimize import minimize_scalar

    x, y = np.asarray(v, float), np.asarray(F, float)
    moves = x > 0.0
    if len(np.unique(np.round(x[moves], 6))) < 3:
        raise NoAnswer(f"{len(np.unique(np.round(x[moves], 6)))} different speeds; a Stribeck curve takes at least 3")
    if fall and len(x) > 4:
        grid = np.geomspace(0.3 * x[moves].min(), 2.0 * x.max(), 400)
        costs = np.array([_linear(x, y, s)[2] for s in grid])
        best = int(np.argmin(costs))
        step = float(grid[min(best + 1, len(grid) - 1)] - grid[best])
        around = (float(grid[max(best - 1, 0)]), float(grid[min(best + 1, len(grid) - 1)]))
        finer = minimize_scalar(
            lambda s: _linear(x, y, s)[2], bounds=around, method="bounded", options={"xatol": 1e-3 * step}
        )
        at = float(finer.x) if finer.fun < costs[best] else float(grid[best])
        a, half, rss = _linear(x, y, at)
        near = costs <= rss * (1.0 + 4.0 / max(len(x) - 4, 1)) + 1e-30 * float(y @ y)  # 95 %: an F ratio of about 4
        near[best] = True  # an exact fit between grid points leaves no grid point near
        # p-value of an F test of two more parameters, with 2 and n - 4 degrees of freedom
        chance = (rss / max(_linear(x, y, None)[2], 1e-300)) ** (0.5 * (len(x) - 4))
        if a[1] > max(resolution * a[0], half[1]) and chance < CHANCE and not near[-1]:
            v_s, width = (None, None) if near[0] else (at, max(0.5 * float(np.ptp(grid[near])), step))
            return Stribeck(a[0], a[0] + a[1], v_s, a[2], half[0], half[0] + half[1], width, half[2])
    a, half, _ = _linear(x[moves], y[moves], None)
    rest = float(y[~moves].mean()) if fall and (~moves).any() else a[0]
    F_S = rest if rest - a[0] > max(resolution * a[0], half[0]) else None
    return Stribeck(a[0], F_S, None, a[1], half[0], None, None, half[1])


def _linear(x: np.ndarray, y: np.ndarray, v_s: float | None) -> tuple[list[float], list[float], float]:
    """Least squares for F_C, (F_S - F_C,) F_v at a given v_s: values, 95 % half widths, sum of squares."""
    columns = [np.ones_like(x), x] if v_s is None else [np.ones_like(x), np.exp(-((x / v_s) ** 2)), x]
    M = np.column_stack(columns)
    a = np.linalg.lstsq(M, y, rcond=None)[0]
    rss = float(np.sum((y - M @ a) ** 2))
    inverse = np.linalg.pinv(M.T @ M)
    half = 2.0 * np.sqrt(np.diag(inverse) * rss / max(len(x) - M.shape[1], 1))
    return a.tolist(), half.tolist(), rss
