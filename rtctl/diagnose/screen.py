"""A first look at every hypothesis: one simulation for each of its directions, and what it would gain beside the base.

At the fitted base the residual r(x) is taken as linear in the base parameters and in the hypothesis's sizes, which are
tried at a typical size (a finite step: dead bands and backlash have no derivative at zero). The gain is that of the
bounded least-squares problem in both, so that what a wrong parameter explains as well is no evidence.

Source: score test (Rao 1948) with nuisance parameters projected out; secant steps for terms that are not smooth.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import Fit, bounded_step, parallel, trust
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.space import INVERSE, Hypothesis

TRIES = 3
RUNAWAY = 9e5  # times the noise: no reading changes by so much
TOO_FAR = 2.0  # times the residual: a step that changes more says little about what is missing


class Score(NamedTuple):
    hypothesis: Hypothesis  # at the seed that did best
    gain: float  # of the cost, predicted
    x: np.ndarray  # predicted, of the whole extended space
    overlap: float  # share of the direction that base parameters explain: 1 cannot be told from them
    power: float  # of the direction beside the base's: cost gained is half of it times the square of the size


class Ground(NamedTuple):
    """The model that hypotheses are tried on, linear about its x."""

    fitted: Fit
    weight: np.ndarray  # of the prior
    H: np.ndarray
    low: np.ndarray
    high: np.ndarray


def screen(problem: Problem, fitted: Fit, candidates: list[Hypothesis]) -> list[Score]:
    """Scores of all candidates, best first; several seeds of one term and node are candidates of their own."""
    weight = fitted.space.prior() * trust(fitted.r, problem.together)
    ground = Ground(fitted, weight, fitted.J.T @ fitted.J + np.diag(weight), *fitted.space.bounds())
    start = problem.residual(fitted.model, coarse=True)
    scores = parallel([partial(_score, problem, ground, start, h) for h in candidates])
    return sorted((score for score in scores if score is not None), key=_gain, reverse=True)


def _gain(score: Score) -> float:
    return score.gain


def _score(problem: Problem, ground: Ground, r: np.ndarray, h: Hypothesis) -> Score | None:
    """Of one hypothesis beside the residual r; None where the model runs away with it."""
    tries = [_change(problem, ground.fitted, r, h, i) for i in h.sizes or [0]]
    C, steps = np.stack([change for change, _ in tries], axis=1), np.array([step for _, step in tries])
    if not np.isfinite(C).all() or (h.sizes and np.abs(C).max() >= RUNAWAY):  # what is there or not may do any much
        return None
    score = _line(ground, h, C / steps) if h.sizes else Score(h, -np.inf, ground.fitted.x, 0.0, 0.0)
    if len(tries) > 1:
        return score
    there = _there(ground, score, *tries[0])
    limit = bool(h.sizes) and h.coordinates[h.sizes[0]].kind == INVERSE
    if limit and there.gain > 0.0:  # below a limit nothing happens: no line leads on from there
        return there
    return max(score, there, key=_gain)


def _change(problem: Problem, fitted: Fit, r: np.ndarray, h: Hypothesis, i: int) -> tuple[np.ndarray, float]:
    """Change of the residual by a step of size `i` that moves the residual by about its own size, and that step.

    A hypothesis without a size is there or is not: its step is to be there.
    """
    space, own = fitted.space.add(h), float(np.linalg.norm(r))
    step = 1.0 if not h.sizes or h.coordinates[i].high >= 1.0 else -1.0
    for _ in range(TRIES):
        start = h.start()
        if h.sizes:
            start[i] += step
        change = problem.residual(space.model(np.concatenate([fitted.x, start])), coarse=True) - r
        size = float(np.linalg.norm(change))
        if size <= TOO_FAR * own or not h.sizes or h.coordinates[i].kind == INVERSE:
            break
        step *= max(0.5 * own / size, 1e-3)
    return change, step


def _line(ground: Ground, h: Hypothesis, C: np.ndarray) -> Score:
    """The best that a straight line along the directions C (rows, sizes) promises."""
    fitted = ground.fitted
    n, k = len(fitted.x), C.shape[1]
    cross = fitted.J.T @ C
    full = np.block([[ground.H, cross], [cross.T, C.T @ C]])
    slope = np.concatenate([fitted.J.T @ fitted.r + ground.weight * fitted.x, C.T @ fitted.r])
    sizes = [h.coordinates[i] for i in h.sizes]
    x = np.concatenate([fitted.x, np.zeros(k)])
    lows = np.concatenate([ground.low, [c.low for c in sizes]])
    highs = np.concatenate([ground.high, [c.high for c in sizes]])
    dx = bounded_step(full, slope, x, lows, highs, 1e-9)
    gain = -(slope @ dx + 0.5 * dx @ full @ dx)
    start = h.start()
    for i, value in zip(h.sizes, dx[n:], strict=True):
        start[i] += value
    alone = np.linalg.lstsq(ground.H, cross, rcond=1e-10)[0]
    left = np.trace(C.T @ C - cross.T @ alone) / max(np.trace(C.T @ C), 1e-300)
    power = float(C[:, 0] @ C[:, 0] - cross[:, 0] @ alone[:, 0])
    return Score(
        h, float(gain), np.concatenate([fitted.x + dx[:n], start]), float(1.0 - np.clip(left, 0.0, 1.0)), power
    )


def _there(ground: Ground, score: Score, change: np.ndarray, step: float) -> Score:
    """The score where the step ended, and not where a line predicts the best: slack, slip and play set in at once."""
    fitted, h = ground.fitted, score.hypothesis
    r = fitted.r + change
    slope = fitted.J.T @ r + ground.weight * fitted.x
    dx = bounded_step(ground.H, slope, fitted.x, ground.low, ground.high, 1e-9)
    x, left = fitted.x + dx, r + fitted.J @ dx
    start = h.start()
    start[h.sizes[:1]] += step
    cost = 0.5 * float(left @ left + ground.weight @ x**2)
    return score._replace(gain=fitted.cost - cost, x=np.concatenate([x, start]))
