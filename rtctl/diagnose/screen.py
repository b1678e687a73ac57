"""A first look at every hypothesis: one simulation for each of its directions, and what it would gain beside the base.

At the fitted base the residual r(x) is taken as linear in the base parameters and in the hypothesis's sizes, which are
tried at a typical size (a finite step: dead bands and backlash have no derivative at zero). The gain is that of the
bounded least-squares problem in both, so that what a wrong parameter explains as well is no evidence.

Source: score test (Rao 1948) with nuisance parameters projected out; secant steps for terms that are not smooth.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import Fit, Problem, bounded_step, parallel, trust
from rtctl.diagnose.space import INVERSE, Hypothesis, Space

TRIES = 3
TOO_FAR = 2.0  # times the residual: a step that changes more says little about what is missing


class Score(NamedTuple):
    hypothesis: Hypothesis  # at the seed that did best
    gain: float  # of the cost, predicted
    x: np.ndarray  # predicted, of the whole extended space
    overlap: float  # share of the direction that base parameters explain: 1 cannot be told from them
    power: float  # of the direction beside the base's: cost gained is half of it times the square of the size


def screen(problem: Problem, fitted: Fit, candidates: list[Hypothesis]) -> list[Score]:
    """Scores of all candidates, best first; several seeds of one term and node are candidates of their own."""
    space, x, r = fitted.space, fitted.x, fitted.r
    low, high = space.bounds()
    weight = space.prior() * trust(r)
    g = fitted.J.T @ r + weight * x
    H = fitted.J.T @ fitted.J + np.diag(weight)
    tries = [(h, i) for h in candidates for i in h.sizes]
    columns = parallel([partial(_secant, problem, space, x, r, h, i) for h, i in tries])
    scores, at = [], 0
    for h in candidates:
        count = len(h.sizes)
        C = np.stack(columns[at : at + count], axis=1) if count else np.zeros((len(r), 0))
        at += count
        if count and np.isfinite(C).all() and np.abs(C).max() < 1e5:
            scores.append(_score(h, C, fitted, g, H, low, high))
    return sorted(scores, key=lambda s: -s.gain)


def _secant(problem: Problem, space: Space, x: np.ndarray, r: np.ndarray, h: Hypothesis, i: int) -> np.ndarray:
    """Change of the residual by one unit of size `i`, from a step that moves the residual by about its own size."""
    c = h.coordinates[i]
    step = 1.0 if c.high >= 1.0 else -1.0
    own = float(np.linalg.norm(r))
    for _ in range(TRIES):
        start = h.start()
        start[i] += step
        change = problem.residual(space.add(h).model(np.concatenate([x, start]))) - r
        size = float(np.linalg.norm(change))
        if size <= TOO_FAR * own or c.kind == INVERSE:
            break
        step *= max(0.5 * own / size, 1e-3)
    return change / step


def _score(
    h: Hypothesis, C: np.ndarray, fitted: Fit, g: np.ndarray, H: np.ndarray, low: np.ndarray, high: np.ndarray
) -> Score:
    n, k = len(g), C.shape[1]
    cross = fitted.J.T @ C
    full = np.block([[H, cross], [cross.T, C.T @ C]])
    slope = np.concatenate([g, C.T @ fitted.r])
    sizes = [h.coordinates[i] for i in h.sizes]
    x = np.concatenate([fitted.x, np.zeros(k)])
    lows = np.concatenate([low, [c.low for c in sizes]])
    highs = np.concatenate([high, [c.high for c in sizes]])
    dx = bounded_step(full, slope, x, lows, highs, 1e-9)
    gain = -(slope @ dx + 0.5 * dx @ full @ dx)
    start = h.start()
    for i, value in zip(h.sizes, dx[n:], strict=True):
        start[i] += value
    alone = np.linalg.lstsq(H, cross, rcond=1e-10)[0]
    left = np.trace(C.T @ C - cross.T @ alone) / max(np.trace(C.T @ C), 1e-300)
    power = float(C[:, 0] @ C[:, 0] - cross[:, 0] @ alone[:, 0]) if k else 0.0
    return Score(
        h, float(gain), np.concatenate([fitted.x + dx[:n], start]), float(1.0 - np.clip(left, 0.0, 1.0)), power
    )
