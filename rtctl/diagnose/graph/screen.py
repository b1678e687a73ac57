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
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.space import INVERSE, Hypothesis

CLOSER = 40  # hypotheses that are judged under their own noise
TRIES = 3
TOO_FAR = 3.0  # times the residual: a step that changes more says little about what is missing
RIDGE = 1e-6


class Score(NamedTuple):
    """What a hypothesis promises."""

    hypothesis: Hypothesis
    gain: float  # nats, under the noise that it leaves; of the less likely ones as `power`
    power: float  # nats, under the noise of what no hypothesis explains
    x: np.ndarray  # of the hypothesis
    norm: float  # of a typical size beside the base, in standard deviations: below 3 or so nothing is seen


class Screened(NamedTuple):
    """Scores, best first, and the likelihood under the noise of what no hypothesis explains."""

    scores: list[Score]
    floor: Likelihood

    def promising(self, most: int) -> list[Score]:
        """Scores in the order in which they deserve a fit: by what they gain, and by the power that they explain, in
        turns."""
        by_power = sorted(self.scores, key=lambda s: -s.power)
        out: list[Score] = []
        for one, other in zip(self.scores, by_power, strict=True):
            out += [s for s in (one, other) if not any(s is t for t in out[-2 * most :])]
        return out


def screen(base: Fitted, candidates: list[Hypothesis]) -> Screened:
    """Scores of all candidates."""
    like = base.like
    Jraw = raw_jacobian(base)
    start = like.raw(base.model, True)
    changes = parallel([partial(_change, base, start, h) for h in candidates])
    like = floor_noise(base, Jraw, [change for found in changes for change, _ in found])
    weight = prior(base.space)
    W, r = like.filtered(Jraw), like.white(base.e)
    A = W.T @ W + np.diag(weight)
    slope = W.T @ r + weight * base.x
    found = [
        _solved(base, like, h, change, W, A, slope, r) for h, change in zip(candidates, changes, strict=True) if change
    ]
    order = sorted(range(len(found)), key=lambda i: -found[i][0].power)
    out = [found[i][0] for i in order[CLOSER:]]
    for i in order[:CLOSER]:
        score, dx, C = found[i]
        e = base.e + np.tensordot(Jraw, dx[: len(base.x)], axes=1) + np.tensordot(C, dx[len(base.x) :], axes=1)
        out.append(score._replace(gain=base.loss - like.loss(e)))
    return Screened(sorted(out, key=lambda s: -s.gain), like)


def floor_noise(base: Fitted, Jraw: np.ndarray, changes: list[np.ndarray]) -> Likelihood:
    """The likelihood with the noise of what neither a parameter nor any hypothesis explains.

    A noise that is estimated under the base alone holds a large effect for noise.
    """
    least = base.like.least
    columns = np.stack(changes, axis=2) if changes else np.zeros((*base.e.shape, 0))
    own = np.linalg.norm(columns / least[:, None], axis=(0, 1))
    columns = columns[:, :, own > 0.0]
    M = np.concatenate([Jraw, columns], axis=2) / least[:, None]
    M = M.reshape(-1, M.shape[2])
    size = np.linalg.norm(M, axis=0)
    M = M[:, size > 0.0] / size[size > 0.0]
    e = (base.e / least).reshape(-1)
    A = M.T @ M
    A[np.diag_indices_from(A)] += RIDGE
    left = (e - M @ np.linalg.solve(A, M.T @ e)).reshape(base.e.shape) * least
    return base.like.told(left)


def raw_jacobian(base: Fitted) -> np.ndarray:
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
    base: Fitted, like: Likelihood, h: Hypothesis, changes: list, W: np.ndarray, A: np.ndarray, slope: np.ndarray,
    r: np.ndarray,
) -> tuple[Score, np.ndarray, np.ndarray]:
    """Score of a hypothesis under the noise of the base, the step of all unknowns and its raw directions."""
    n, k = len(base.x), len(changes)
    C = np.stack([change / step for change, step in changes], axis=2)
    white = like.filtered(C)
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
    return Score(h, float(gain), float(gain), at, norm), dx, C
