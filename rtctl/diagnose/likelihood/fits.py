"""Fit of a model to a recording under the noise of its own residual, with its evidence.

The noise is estimated from the residual of the fit, and the fit is repeated: a noise that is estimated without an
effect includes the effect. The evidence is Laplace's approximation: the likelihood at its maximum, times the prior
there, times the volume of the posterior.

Source: MacKay, Information Theory, Inference, and Learning Algorithms (2003), ch. 28; Miller & Dunson, Robust Bayesian
inference via coarsening, JASA 114 (2019) for the power of the likelihood.
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import EXACT
from rtctl.diagnose.likelihood.descent import ALL, EFFECTS, Point, derivatives, descend, weights
from rtctl.diagnose.likelihood.inexact import errors
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.pushes import pushes
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.space import COSINE, INVERSE, REST, SINE, SIZE, Space
from rtctl.plants.physics import TERMS

ROUNDS = 3  # rounds of noise and fit, at most
MOST = 10  # Gauss-Newton steps of a round, at most
ENOUGH = 2.0  # nats: least gain of a round before a further round
LOOSE = (300.0, 30.0, 3.0)  # times the curvature of the prior: directions of less curvature count as undetermined
MATTERS = 0.5  # nats of the prior: least gain of a return to nominal values


class Fitted(NamedTuple):
    """A model fitted to a record."""

    space: Space
    x: np.ndarray
    e: np.ndarray  # (blocks, sensors) residual, SI
    J: np.ndarray  # (blocks, sensors, unknowns) of the residual, in single precision
    A: np.ndarray  # (unknowns, unknowns) inner products of the innovations of J
    like: Likelihood  # with the noise of its own residual
    loss: float  # negative logarithm of the likelihood, nats
    pushes: tuple[np.ndarray, ...]  # (windows, followed) corrections of the observer in each recording, N or Nm
    fresh: int = ALL  # derivatives that are current at the solution: of the effects (a draft), or of all unknowns

    @property
    def model(self):
        """Model with the fitted values."""
        model: GraphModel = self.space.model(self.x)
        return model

    @property
    def names(self) -> tuple[str, ...]:
        """term:node of each hypothesis."""
        return tuple(h.name for h in self.space.hypotheses)

    @property
    def seldom(self) -> float:
        """Prior odds, nats, against terms whose law usually has another name."""
        return sum(TERMS[h.term].seldom for h in self.space.hypotheses)

    @property
    def power(self) -> float:
        """Power of the likelihood: share of its innovations that counts."""
        return self.like.power

    @property
    def information(self) -> np.ndarray:
        """Second derivative (unknowns, unknowns) of the negative logarithm of the posterior."""
        return curvature(self, self.power)

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence, nats, up to a constant that all models of the record share."""
        weight = prior(self.space)
        volume = float(np.linalg.slogdet(self.information)[1]) - float(np.sum(np.log(weight)))
        fitness = -self.power * self.loss - 0.5 * float(weight @ self.x**2)
        return fitness - 0.5 * float(volume)


def curvature(f: Fitted, power: float) -> np.ndarray:
    """Second derivative (unknowns, unknowns) of the negative logarithm of a posterior, likelihood to a power."""
    return np.asarray(power * f.A + np.diag(prior(f.space)))


def prior(space: Space) -> np.ndarray:
    """Precision (unknowns,) of the prior: by the tolerance of a parameter, by the typical size of an effect."""
    out = list(weights(space)[: space.nb])
    for h in space.hypotheses:
        for c in h.coordinates:
            width = 1.0 if np.isinf(c.high) or np.isinf(c.low) else max(0.3 * (c.high - c.low), 1e-3)
            out.append(1.0 / (SPREAD[c.kind] if c.kind in SPREAD else min(width, 2.0)) ** 2)
    return np.array(out)


SPREAD = {SIZE: 3.0, COSINE: 3.0, SINE: 3.0, INVERSE: 2.0, REST: 3.0}  # prior deviation of a size, in typical sizes


def refit(
    like: Likelihood,
    space: Space,
    x: np.ndarray | None = None,
    known: np.ndarray | None = None,
    floor: Likelihood | None = None,
    rounds: int = MOST,
    relax: bool = True,
    draft: bool = False,
) -> Fitted:
    """Fitted model of `space`, from x: by least squares and under the noise `floor`, then under its own noise.

    Least squares finds large effects; a noise estimated without these effects finds small ones. `known` (blocks,
    sensors, unknowns) are the derivatives in the first columns, from a model with fewer effects. Parameters are fitted
    with exact laws. Errors of the laws enter the evidence only: in a fit they would explain part of an effect of too
    small a size.

    A `draft` recomputes the derivatives of the effects only. The derivatives of the parameters, most of the work of a
    fit, stay as `known`. The evidence of a draft is a few nats too low; `finished` fits the draft to convergence.
    """
    like = like.slackened(None)
    low, high = space.bounds()
    x = np.clip(space.start() if x is None else np.asarray(x, float), low, high)
    e = like.raw(space.model(x))
    J = np.zeros((*e.shape, len(x)), np.float32)
    count = 0 if known is None else known.shape[2]
    if known is not None:
        J[..., :count] = known
    start = Point(x, e, derivatives(like, space, x, range(count, len(x)), J), EFFECTS if count else ALL)

    own = _judged(like, descend(like.flat(e), space, start, rounds, 1e-2, EFFECTS))
    if floor is not None:
        own = min(own, _judged(like, descend(floor, space, start, rounds, 1e-2, EFFECTS)), key=lambda one: one.loss)
    if count and space.hypotheses:
        own = _under_own_noise(like, space, own, rounds, EFFECTS)
        if draft:
            return evaluated(like, space, own.at)._replace(fresh=EFFECTS)
    model = evaluated(like, space, _under_own_noise(like, space, own, rounds, ALL).at)
    return relaxed(model) if relax else model


def finished(f: Fitted) -> Fitted:
    """Model fitted to convergence, from a draft: the derivatives of all unknowns are those at the solution."""
    if f.fresh == ALL:
        return f
    like = f.like.slackened(None)
    start = _judged(like, Point(f.x, f.e, f.J, EFFECTS))
    return evaluated(like, f.space, _under_own_noise(like, f.space, start, MOST, ALL).at)


class Judged(NamedTuple):
    """Point of a fit, with the noise model and the loss estimated from its own residual."""

    loss: float  # nats
    at: Point
    like: Likelihood


def _judged(like: Likelihood, at: Point) -> Judged:
    own = like.told(at.e)
    return Judged(own.loss(at.e), at, own)


def _under_own_noise(like: Likelihood, space: Space, best: Judged, rounds: int, freshest: int) -> Judged:
    """Iteratively reweighted fit: each round takes the noise model of the round before, while the loss falls."""
    for _ in range(ROUNDS):
        found = _judged(like, descend(best.like, space, best.at, rounds, 1e-3, freshest))
        gain = best.loss - found.loss
        if gain > 0.0:
            best = found
        else:  # keep the later derivatives
            best = best._replace(at=best.at._replace(J=found.at.J))
        if gain < ENOUGH:
            break
    return best


def relaxed(f: Fitted) -> Fitted:
    """Model with the undetermined directions of its parameters back at nominal values, where the evidence gains.

    Difference quotients of a machine with dry friction are inexact. A direction that the recording does not determine,
    as the common factor of all forces and inertias, seems weakly determined. A fit that has moved along this direction
    does not return.
    """
    weight = prior(f.space)
    root = np.sqrt(weight)
    exact = f.like.slackened(None)
    own = exact.told(f.e)  # noise of f: the residual of a first step along a curved valley is not noise
    values, vectors = np.linalg.eigh(f.power * f.A / np.outer(root, root))
    for loose in LOOSE:
        idle = vectors[:, values < loose]
        z = f.x * root
        x = (z - idle @ (idle.T @ z)) / root
        gained = 0.5 * float(weight @ (f.x**2 - x**2))
        if gained < MATTERS:
            continue
        x = np.clip(x, *f.space.bounds())
        e = f.like.raw(f.space.model(x))
        at = descend(own, f.space, Point(x, e, f.J), 3, 1e-3, EFFECTS)
        trial = evaluated(exact, f.space, at)
        if trial.log_evidence > f.log_evidence:
            return trial
    return f


def evaluated(like: Likelihood, space: Space, at: Point) -> Fitted:
    """Fitted model at a point of a fit, with the evidence under its own noise model and law errors.

    The noise level decides how much law errors explain. Every model takes the noise of its own residual: evidences of
    models are comparable, whichever noise their fits began with. The recording also decides how exact the laws are.
    """
    own = like.slackened(None).told(at.e)
    laws, fixed = errors(own, space, at.x, at.e)
    if laws.shape[2] + fixed.shape[2]:
        tried = [
            own.slackened(np.concatenate([fixed, share * laws], axis=2), odds).told(at.e)
            for share, odds in EXACT.items()
        ]
        own = min(tried, key=lambda one: one.loss(at.e))
    white = own.white(at.J)
    return Fitted(space, at.x, at.e, at.J, white.T @ white, own, own.loss(at.e), pushes(own, space.model(at.x)))


def without(base: Fitted, *indices: int) -> tuple[Space, np.ndarray, np.ndarray]:
    """Space, start and derivatives of a model without one or several of its hypotheses."""
    space, x, J = base.space, base.x, base.J
    for index in sorted(indices, reverse=True):
        gone = space.columns(index)
        space, x, J = space.without(index), np.delete(x, gone), np.delete(J, gone, axis=2)
    return space, x, J
