"""Prediction of rows that no fit saw: fitted to the first part of a record, judged on the rest under the observer."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import WORSE
from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.model import GraphModel

HELD = 0.25  # share of the record
ROUNDS = 6  # steps of a fit to the rows before


class Heldout(NamedTuple):
    """Errors on the held-out rows by the spread of the followed sensor, and the rows that were fitted."""

    before: float
    after: float
    floor: float
    gain: float  # nats by which the best predicts them better, each under the noise of the rows before
    fits: tuple[Fitted, Fitted]  # base and best, as the rows before were fitted
    early: Likelihood  # of the rows before
    late: Likelihood  # of the held-out rows

    @property
    def rows(self) -> tuple[int, int]:
        """First row that was fitted, and the first that was not."""
        return self.early.rows

    @property
    def models(self) -> tuple[GraphModel, GraphModel]:
        """The models of both."""
        return self.fits[0].model, self.fits[1].model


def predict(base: Fitted, best: Fitted, fewer: bool = False) -> tuple[Heldout, Fitted]:
    """Held-out error of the base and of the best model, each fitted to the rows before, and the best model, without
    the effects (`fewer`) without which the held-out rows are predicted better."""
    first, late = base.like.split(HELD)

    own = fitted_to(first, best)
    while fewer and len(best.names) > 1:
        less = [refit(first, *without(own, index), rounds=ROUNDS) for index in range(len(best.names))]
        e = late.raw(own.model)
        gains = [ahead(late, (own, e), (f, late.raw(f.model))) for f in less]
        index = int(np.argmin(gains))
        if gains[index] > -WORSE:
            break
        own, best = less[index], refit(best.like, *without(best, index))
    return judged(base.like, first, late, (fitted_to(first, base), own)), best


def ahead(late: Likelihood, one: tuple[Fitted, np.ndarray], other: tuple[Fitted, np.ndarray]) -> float:
    """Nats by which one model foretells the rows of `late` better than another, each under its noise of rows before;
    each comes with its residuals (blocks, sensors) there.

    A model that left little there, without memory, loses by its slow errors in later rows to one whose larger errors
    are expected. So it is also asked which is nearer, both under the noise of the first, and a clear answer counts.
    """
    (first, e), (second, f) = one, other
    told = late.foretold(e, first.like)
    own, nearer = late.foretold(f, second.like) - told, late.foretold(f, first.like) - told
    return max(own, nearer) if nearer > WORSE else own


def predicted(heldout: Heldout, best: Fitted) -> Heldout:
    """The same with another best model."""
    early, late = heldout.early, heldout.late
    return judged(best.like, early, late, (heldout.fits[0], fitted_to(early, best)))


def fitted_to(rows: Likelihood, f: Fitted) -> Fitted:
    """A model fitted to some rows, from where it is; as it is where nothing may move."""
    return refit(rows, f.space, f.x, rounds=ROUNDS) if f.space.names or f.space.hypotheses else f


def judged(whole: Likelihood, early: Likelihood, late: Likelihood, fits: tuple[Fitted, Fitted]) -> Heldout:
    """Errors of the base and the best model on the rows of `late`, by the spread of each sensor on those of `whole`."""
    spread = whole.spread
    residuals = [late.raw(f.model) for f in fits]
    before, after = (float(np.sqrt(np.mean(np.mean(e**2, axis=0) / spread**2))) for e in residuals)
    floor = float(np.sqrt(np.mean(whole.least**2 * whole.mean / spread**2)))
    gain = ahead(late, (fits[1], residuals[1]), (fits[0], residuals[0]))
    return Heldout(before, after, min(floor, after), gain, fits, early, late)
