"""Screening: what each hypothesis would gain beside a fitted model, from one simulation for each of its sizes.

The residual is linear in the fitted parameters and, by a secant of typical size, in the size of an effect. Each
hypothesis is solved for under the noise of the model, then judged under the noise that it leaves itself.

Source: score test (Rao 1948) with nuisance parameters projected out; secants for effects that have no derivative.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import bounded_step, parallel
from rtctl.diagnose.graph.fits import Fitted, prior
from rtctl.diagnose.space import INVERSE, Hypothesis

CLOSER = 40  # hypotheses that are judged under their own noise
TRIES = 3
TOO_FAR = 3.0  # times the residual: a step that changes more says little about what is missing
STEPS = 2e-3


class Score(NamedTuple):
    """What a hypothesis promises."""

    hypothesis: Hypothesis
    gain: float  # nats
    x: np.ndarray  # of the hypothesis
    norm: float  # of a typical size beside the base, in standard deviations: below 3 or so nothing is seen


def screen(base: Fitted, candidates: list[Hypothesis]) -> list[Score]:
    """Scores of all candidates, best first."""
    like = base.like
    Jraw = _raw_jacobian(base)
    start = like.raw(base.model, True)
    changes = parallel([partial(_change, base, start, h) for h in candidates])
    weight = prior(base.space)
    W, r = like.filtered(Jraw), like.white(base.e)
    A = W.T @ W + np.diag(weight)
    slope = W.T @ r + weight * base.x
    found = [
        _solved(base, h, change, W, A, slope, r) for h, change in zip(candidates, changes, strict=True) if change
    ]
    order = sorted(range(len(found)), key=lambda i: -found[i][0].gain)
    out = [found[i][0] for i in order[CLOSER:]]
    for i in order[:CLOSER]:
        score, dx, C = found[i]
        e = base.e + np.tensordot(Jraw, dx[: len(base.x)], axes=1) + np.tensordot(C, dx[len(base.x) :], axes=1)
        out.append(score._replace(gain=base.loss - like.loss(e)))
    return sorted(out, key=lambda s: -s.gain)


def _raw_jacobian(base: Fitted) -> np.ndarray:
    """Derivatives (blocks, sensors, unknowns) of the residual."""
    like, space = base.like, base.space
    start, steps, high = like.raw(base.model, True), space.steps(), space.bounds()[1]

    def column(i: int) -> np.ndarray:
        x, step = base.x.copy(), steps[i] if base.x[i] + steps[i] <= high[i] else -steps[i]
        x[i] += step
        return np.asarray((like.raw(space.model(x), True) - start) / step)

    columns = parallel([partial(column, i) for i in range(len(base.x))])
    return np.stack(columns, axis=2) if columns else np.zeros((*base.e.shape, 0))


def _change(base: Fitted, start: np.ndarray, h: Hypothesis) -> list[tuple[np.ndarray, float]]:
    """Change of the residual for a step of each size, about as large as the residual itself, and that step."""
    like, space = base.like, base.space.add(h)
    own = float(np.linalg.norm(like.white(start)))
    out = []
    for i in h.sizes or [-1]:
        step = 1.0 if i < 0 or h.coordinates[i].high >= 1.0 else -1.0
        for _ in range(TRIES):
            at = h.start()
            if i >= 0:
                at[i] += step
            change = like.raw(space.model(np.concatenate([base.x, at])), True) - start
            if not np.isfinite(change).all():
                return []
            size = float(np.linalg.norm(like.white(change)))
            if size <= TOO_FAR * own or i < 0 or h.coordinates[i].kind == INVERSE:
                break
            step *= max(0.5 * own / size, 1e-3)
        out.append((change, step))
    return out


def _solved(
    base: Fitted, h: Hypothesis, changes: list, W: np.ndarray, A: np.ndarray, slope: np.ndarray, r: np.ndarray
) -> tuple[Score, np.ndarray, np.ndarray]:
    """Score of a hypothesis under the noise of the base, the step of all unknowns and its raw directions."""
    n, k = len(base.x), len(changes)
    C = np.stack([change / step for change, step in changes], axis=2)
    white = base.like.filtered(C)
    cross = W.T @ white
    own = white.T @ white
    full = np.block([[A, cross], [cross.T, own + np.eye(k) / 9.0]])
    low, high = base.space.bounds()
    x = np.concatenate([base.x, np.zeros(k)])
    if h.sizes:
        lows = np.array([h.coordinates[i].low for i in h.sizes])
        highs = np.array([h.coordinates[i].high for i in h.sizes])
    else:
        lows, highs = np.zeros(k), np.ones(k)
    whole = np.concatenate([slope, white.T @ r])
    dx = bounded_step(full, whole, x, np.concatenate([low, lows]), np.concatenate([high, highs]), 1e-9)
    if not h.sizes:  # it is there or not
        dx[n:] = 1.0
    gain = -(whole @ dx + 0.5 * dx @ full @ dx)
    at = h.start()
    for i, value in zip(h.sizes, dx[n:], strict=False):
        at[i] += value
    alone = np.linalg.solve(A + 1e-9 * np.diag(np.diag(A)) + 1e-300 * np.eye(n), cross) if n else cross[:0]
    norm = float(np.sqrt(max(own[0, 0] - (cross[:, 0] @ alone[:, 0] if n else 0.0), 0.0)))
    return Score(h, float(gain), at, norm), dx, C
