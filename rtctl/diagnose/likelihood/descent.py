"""Descent of a fit: Gauss-Newton steps inside bounds, with quasi-Newton updates of the derivatives.

Derivatives are those of the residuals (blocks, sensors, unknowns). They do not depend on the noise model: a fit starts
with the derivatives of the model that it extends. Between difference quotients Broyden's formula updates them. Where a
step gains less than predicted, the columns of the effects are recomputed first, then all columns.

Source: Nocedal & Wright, Numerical Optimization (2006), ch. 10; Broyden, Math. Comp. 19 (1965).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.solver import bounded_step, quotients, trust
from rtctl.diagnose.model.space import WIDE, Space

UNKNOWN = WIDE / 2  # prior standard deviation, in logarithm, of a parameter without a tolerance
HONEST = 0.3  # share of the predicted gain: least gain of a step that keeps the derivatives
SMALLEST = 1e-9  # step of an unknown below which a fit has converged
STALE, EFFECTS, ALL = range(3)  # derivatives recomputed since the last step: none, of the effects, all
TRIES = {STALE: 3, EFFECTS: 3, ALL: 12}  # dampings of a step, at most


def weights(space: Space) -> np.ndarray:
    """Precision (unknowns,) of the prior in a fit: by the tolerance of a parameter, 0 of the effects.

    A parameter without a tolerance has a weak prior: it stays in place where the recording does not determine it.
    """
    known = space.prior()
    return np.asarray(np.where((known > 0.0) | (np.arange(len(known)) >= space.nb), known, 1.0 / UNKNOWN**2))


class Point(NamedTuple):
    """Point of a fit: unknowns, residuals and derivatives."""

    x: np.ndarray
    e: np.ndarray  # (blocks, sensors) residuals, SI
    J: np.ndarray  # (blocks, sensors, unknowns), of e by x, in single precision
    fresh: int = STALE


def derivatives(
    like: Likelihood, space: Space, x: np.ndarray, columns: Sequence[int], into: np.ndarray | None = None
) -> np.ndarray:
    """Difference quotients (blocks, sensors, unknowns) of the residuals in some columns.

    Steps go away from the upper bound. The other columns are those of `into`, or 0.
    """
    if into is not None and not columns:
        return into
    start, coarse = like.rough(space.model(x))
    J = np.zeros((*start.shape, len(x)), np.float32) if into is None else into
    found = quotients(lambda model: like.raw(model, coarse), space, x, start, columns, like.ran_away)
    for i, values in zip(columns, found, strict=True):
        J[..., i] = values
    return J


class Descent:
    """Steps of one fit under one noise; the derivatives of the given point are overwritten."""

    def __init__(self, like: Likelihood, space: Space, at: Point):
        self.like, self.space = like, space
        self.x, self.e, self.J, _ = at
        self.low, self.high = space.bounds()
        self.prior = weights(space)
        self.r = like.white(self.e)
        self.cost = self._cost(self.r, self.x)
        self.W, self.A = np.zeros((len(self.r), len(self.x))), np.zeros((len(self.x), len(self.x)))
        self._whiten(range(len(self.x)))

    def _whiten(self, columns: Sequence[int]) -> None:
        """Update the innovations of the derivatives in some columns, and their inner products with all columns."""
        at = list(columns)
        self.W[:, at] = self.like.white(self.J[..., at])
        self.A[:, at] = self.W.T @ self.W[:, at]
        self.A[at] = self.A[:, at].T

    def _cost(self, r: np.ndarray, x: np.ndarray) -> float:
        return 0.5 * float(r @ r) + 0.5 * float((self.prior * trust(r)) @ x**2)

    def renew(self, columns: Sequence[int]) -> None:
        """Recompute the derivatives in some columns."""
        derivatives(self.like, self.space, self.x, columns, self.J)
        self._whiten(columns)

    def effects(self) -> list[int]:
        """Columns of the effects."""
        return list(range(self.space.nb, len(self.x)))

    def step(self, damping: float, tries: int) -> tuple[float, float, float]:
        """Gain of a step to a lower cost, its predicted gain, and its damping; no gains (0, 0) without such a step."""
        weight = self.prior * trust(self.r)
        H, g = self.A + np.diag(weight), self.W.T @ self.r + weight * self.x
        for _ in range(tries):
            dx = bounded_step(H, g, self.x, self.low, self.high, damping)
            if not np.abs(dx).max(initial=0.0) > SMALLEST:
                break
            x = self.x + dx
            e = self.like.raw(self.space.model(x))
            r = self.like.white(e)
            cost = self._cost(r, x)
            gained = self.cost - cost
            if gained > 0.0:
                promised = -float(g @ dx + 0.5 * dx @ H @ dx)
                if gained > HONEST * promised:
                    self._learn(dx, e - self.e, r - self.r)
                self.x, self.e, self.r, self.cost = x, e, r, cost
                return gained, promised, damping
            damping *= 10
        return 0.0, 0.0, damping

    def _learn(self, dx: np.ndarray, de: np.ndarray, dr: np.ndarray) -> None:
        """Broyden's correction of the derivatives after a step."""
        v = dx / float(dx @ dx)
        self.J += np.multiply.outer(de - self.J @ dx.astype(np.float32), v).astype(np.float32)
        u = dr - self.W @ dx
        across = np.outer(self.W.T @ u, v)
        self.A += across + across.T + float(u @ u) * np.outer(v, v)
        self.W += np.outer(u, v)


def descend(like: Likelihood, space: Space, at: Point, rounds: int, enough: float, freshest: int = ALL) -> Point:
    """Point of least squares under the noise of `like`, from a point with known derivatives.

    The descent stops where a step gains less than a share `enough` of the cost, with derivatives as current as
    `freshest`.
    """
    now, damping, fresh = Descent(like, space, at._replace(J=at.J.copy())), 1e-4, at.fresh
    for _ in range(rounds):
        cost = now.cost
        gained, promised, damping = now.step(damping, TRIES[fresh])
        damping = 1e-4 if gained == 0.0 else max(damping / 10, 1e-8)
        if gained < enough * cost and fresh >= freshest:
            break
        if gained >= enough * cost and gained > HONEST * promised:
            fresh = STALE
            continue
        fresh = min(fresh + 1 if space.hypotheses else ALL, freshest)
        now.renew(now.effects() if fresh == EFFECTS else range(len(now.x)))
    return Point(now.x, now.e, now.J, fresh)
