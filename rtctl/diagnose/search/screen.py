"""Screening: what each hypothesis would gain beside a fitted model, from one simulation for each of its sizes.

The residual is linear in the fitted parameters and, by a secant of typical size, in the size of an effect. Each
hypothesis is solved for under the noise of the model, then judged under the noise that it leaves itself.

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

TRIES = 3
TOO_FAR = 3.0  # times the residual: a step that changes more says little about what is missing
RIDGE = 1e-6
ASKED = 40  # hypotheses that take off most, of which the gain under a noise of their own is asked
FACTORS = (0.1, 0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # of the size that a secant promises
IDLE = 0.01  # of the least noise: largest change of a residual at which the gradient of a fit is zero
SAME = 0.2  # relative difference of two estimated sizes that give one start


class Score(NamedTuple):
    """What a hypothesis promises."""

    hypothesis: Hypothesis
    gain: float  # nats, under the noise that it leaves; -inf where it takes off too little for that to be asked
    power: float  # half the sum of squares that least squares takes off, in variances of the residual
    x: tuple[np.ndarray, ...]  # of the hypothesis, by the noise under which it was solved for
    norm: float  # of a typical size beside the base, in standard deviations: below 3 or so nothing is seen


class Screened(NamedTuple):
    """Scores, best first, and the linear models about which they hold: under the noise of what no hypothesis explains,
    and by least squares."""

    scores: list[Score]
    about: tuple[Linear, ...]

    @property
    def floor(self) -> Likelihood:
        """Noise of what no hypothesis explains."""
        return self.about[0].like

    def starts(self, score: Score, most: int) -> list[np.ndarray]:
        """Places (unknowns of the base and the hypothesis) to fit from: sizes far from what a secant says as well, the
        base moved along with each; the best first."""
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
    """Scores of all candidates."""
    own = Linear(base)
    for h in candidates:  # simulated once, before threads ask for the same
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
    """Numbers of the candidates that take off most, and of the best of each term."""
    order = sorted(range(len(candidates)), key=lambda k: -powers[k])
    best: dict[str, int] = {}
    for k in order:
        best.setdefault(candidates[k].term, k)
    return list(dict.fromkeys([*order[:ASKED], *best.values()]))


def floor_noise(about: Linear, changes: list[np.ndarray]) -> Likelihood:
    """The likelihood with the noise of what neither a parameter nor any hypothesis explains.

    A noise that is estimated under the base alone holds a large effect for noise.
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
    """Change of the residual for a step of each size, about as large as the residual itself, and that step."""
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
    """Score of a hypothesis, solved for beside the parameters, and the step of both; C (blocks, sensors, sizes) is what
    its sizes do, r are the innovations of the base, `slope` is theirs."""
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
    if not h.sizes:  # it is there or not
        dx[n:] = 1.0
    power = -(whole @ dx + 0.5 * dx @ full @ dx)
    at = h.start()
    for i, value in zip(h.sizes, dx[n:], strict=False):
        at[i] += value
    A = about.H
    alone = np.linalg.solve(A + 1e-9 * np.diag(np.diag(A)) + 1e-300 * np.eye(n), cross) if n else cross[:0]
    norm = float(np.sqrt(max(own[0, 0] - (cross[:, 0] @ alone[:, 0] if n else 0.0), 0.0)))
    return Score(h, -np.inf, float(power), (at,), norm), dx
