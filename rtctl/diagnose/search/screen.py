"""Screening: gain of each hypothesis beside a fitted model, from one simulation for each of its sizes.

The residual is linearised in the fitted parameters and, by a secant of typical size, in the size of an effect. Each
hypothesis is solved under the noise of the model, then scored under the noise of its own residual.

Source: score test (Rao 1948) with nuisance parameters projected out; secants for effects that have no derivative.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.linear import DAMPING, Linear
from rtctl.diagnose.likelihood.solver import bounded_step, parallel
from rtctl.diagnose.model.space import INVERSE, SIZE, Hypothesis

TRIES = 3  # lengths of a secant, at most
TOO_FAR = 3.0  # times the norm of the residual: largest change by a secant
RIDGE = 1e-6  # ridge of the normal equations, for columns of norm one
ASKED = 40  # hypotheses of highest power, whose gain under the noise of their own residual is computed
FACTORS = (0.1, 0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # times the size by a secant: starts of a size
IDLE = 0.01  # share of the least noise: largest change of a residual at which the gradient of a fit is zero
SAME = 0.2  # relative difference of two estimated sizes that give one start


class Score(NamedTuple):
    """Screening score of a hypothesis."""

    hypothesis: Hypothesis
    gain: float  # nats, under the noise of its own residual; -inf where it is not computed
    power: float  # half the fall of the sum of squares by least squares, in variances of the residual
    x: tuple[np.ndarray, ...]  # of the hypothesis, one solution for each noise
    norm: float  # change by a typical size beside the base, in standard deviations: visible from about 3


class Screened(NamedTuple):
    """Scores, best first, and the linear models of the base under the noise floor and by least squares."""

    scores: list[Score]
    about: tuple[Linear, ...]

    @property
    def floor(self) -> Likelihood:
        """Likelihood under the noise that no hypothesis explains."""
        return self.about[0].like

    def starts(self, score: Score, most: int) -> list[np.ndarray]:
        """Starts (unknowns of the base and the hypothesis) of a fit, the lowest loss first.

        Sizes include multiples of the size by the secant. The parameters of the base are adapted to each start.
        """
        h, base = score.hypothesis, self.about[0].base
        space = base.space.add(h)
        sizes = np.array([c.kind in (SIZE, INVERSE) for c in h.coordinates], bool)
        first, *rest = score.x
        told = [first, *(x for x in rest if not np.allclose(x, first, rtol=SAME, atol=SAME))]
        xs = [np.where(sizes, k * x, x) for x in told for k in (FACTORS if sizes.any() else (1.0,))]
        limits = np.array([c.kind == INVERSE for c in h.coordinates], bool)
        if limits.any():  # the secant of a limit is zero while no force reaches it; 1 is the limit hinted by the record
            xs.append(np.where(limits, 1.0, h.start()))
        low, high = space.bounds()
        n, begin = len(base.x), self.about[0].start_of(h)

        def placed(x: np.ndarray) -> list[tuple[float, np.ndarray]]:
            at = np.clip(np.concatenate([base.x, x]), low, high)
            change = base.like.raw(space.model(at), self.about[0].coarse) - begin
            if not (np.abs(change) > IDLE * base.like.least).any():
                return []
            e = base.e + change
            steps = [about.step(e) for about in self.about]
            losses = [base.like.loss(e + np.tensordot(self.about[0].raw, dx, axes=1)) for dx in steps]
            return [(loss, np.concatenate([base.x + dx, at[n:]])) for loss, dx in zip(losses, steps, strict=True)]

        found = [pair for pairs in parallel([partial(placed, x) for x in xs]) for pair in pairs]
        return [x for _, x in sorted(found, key=lambda pair: pair[0])[:most]] or [np.concatenate([base.x, score.x[0]])]


def screen(base: Fitted, candidates: list[Hypothesis]) -> Screened:
    """Screening scores of all candidates beside a fitted model."""
    own = Linear(base)
    for h in candidates:  # simulated once, before several threads need it
        own.start_of(h)
    changes = parallel([partial(_change, own, h) for h in candidates])
    about = own.under(floor_noise(own, [change for found in changes for change, _ in found]))
    flat = own.under(base.like.flat(base.e))
    columns = [np.stack([change / step for change, step in found], axis=2) for found in changes]

    def gain(about: Linear, dx: np.ndarray, C: np.ndarray) -> float:
        return base.loss - base.like.loss(about.left(dx, C))

    def scores(about: Linear) -> list[Score]:
        r = about.like.white(base.e)
        slope = about.slope(r)
        solved = parallel([partial(_solved, about, h, C, r, slope) for h, C in zip(candidates, columns, strict=True)])
        asked = _first(candidates, [score.power for score, _ in solved])
        gains = dict(zip(asked, parallel([partial(gain, about, solved[k][1], columns[k]) for k in asked]), strict=True))
        return [score._replace(gain=gains.get(k, score.gain)) for k, (score, _) in enumerate(solved)]

    both = [
        one._replace(gain=max(one.gain, other.gain), power=other.power, x=(*one.x, *other.x))
        for one, other in zip(scores(about), scores(flat), strict=True)
    ]
    return Screened(sorted(both, key=lambda s: -s.gain), (about, flat))


def _first(candidates: list[Hypothesis], powers: list[float]) -> list[int]:
    """Indices of the candidates with the highest power, and of the best candidate of each term."""
    order = sorted(range(len(candidates)), key=lambda k: -powers[k])
    best: dict[str, int] = {}
    for k in order:
        best.setdefault(candidates[k].term, k)
    return list(dict.fromkeys([*order[:ASKED], *best.values()]))


def floor_noise(about: Linear, changes: list[np.ndarray]) -> Likelihood:
    """Likelihood under the noise that neither a parameter nor any hypothesis explains.

    A noise that is estimated under the base alone includes any large effect.
    """
    base = about.base
    least = base.like.least
    columns = np.stack(changes, axis=2) if changes else np.zeros((*base.e.shape, 0))
    own = np.linalg.norm(columns / least[:, None], axis=(0, 1))
    columns = columns[:, :, own > 0.0]
    M = np.concatenate([about.raw, columns], axis=2) / least[:, None]
    M = M.reshape(-1, M.shape[2])
    size = np.linalg.norm(M, axis=0)
    M = M[:, size > 0.0] / size[size > 0.0]
    e = (base.e / least).reshape(-1)
    A = M.T @ M
    A[np.diag_indices_from(A)] += RIDGE
    left = (e - M @ np.linalg.solve(A, M.T @ e)).reshape(base.e.shape) * least
    return base.like.told(left)


def _change(about: Linear, h: Hypothesis) -> list[tuple[np.ndarray, float]]:
    """Changes (blocks, sensors) of the residual, about as large as the residual, and their steps, by size."""
    base = about.base
    like, space = base.like, base.space.add(h)
    own = float(np.linalg.norm(like.white(about.start)))
    begin = about.start_of(h)
    out = []
    for i in h.sizes or [-1]:
        step = 1.0 if i < 0 or h.coordinates[i].high >= 1.0 else -1.0
        for _ in range(TRIES):
            at = h.start()
            if i >= 0:
                at[i] += step
            change = like.raw(space.model(np.concatenate([base.x, at])), about.coarse) - begin
            size = float(np.linalg.norm(like.white(change)))
            if size <= TOO_FAR * own or i < 0 or h.coordinates[i].kind == INVERSE:
                break
            step *= max(0.5 * own / size, 1e-3)
        out.append((change, step))
    return out


def _solved(about: Linear, h: Hypothesis, C: np.ndarray, r: np.ndarray, slope: np.ndarray) -> tuple[Score, np.ndarray]:
    """Score of a hypothesis, solved together with the parameters, and the step (unknowns,) of both.

    Secants of its sizes are C (blocks, sensors, sizes), innovations of the base r (innovations,), and the derivative of
    the cost at r is `slope` (unknowns,).
    """
    base, like = about.base, about.like
    n, k = len(base.x), C.shape[2]
    white = like.white(C)
    cross = about.white.T @ white
    own = white.T @ white
    full = np.block([[about.H, cross], [cross.T, own + np.eye(k) / 9.0]])
    low, high = base.space.bounds()
    x = np.concatenate([base.x, np.zeros(k)])
    if h.sizes:
        lows = np.array([h.coordinates[i].low for i in h.sizes])
        highs = np.array([h.coordinates[i].high for i in h.sizes])
    else:
        lows, highs = np.zeros(k), np.ones(k)
    whole = np.concatenate([slope, white.T @ r])
    dx = bounded_step(full, whole, x, np.concatenate([low, lows]), np.concatenate([high, highs]), DAMPING)
    if not h.sizes:  # a hypothesis without sizes is present or absent
        dx[n:] = 1.0
    power = -(whole @ dx + 0.5 * dx @ full @ dx)
    at = h.start()
    for i, value in zip(h.sizes, dx[n:], strict=False):
        at[i] += value
    A = about.H
    alone = np.linalg.solve(A + 1e-9 * np.diag(np.diag(A)) + 1e-300 * np.eye(n), cross) if n else cross[:0]
    norm = float(np.sqrt(max(own[0, 0] - (cross[:, 0] @ alone[:, 0] if n else 0.0), 0.0)))
    return Score(h, -np.inf, float(power), (at,), norm), dx
