"""Prediction of rows that no fit saw: fitted to the first part of a record, judged on the rest under the observer."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.graph.fits import Fitted, refit
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.graph.model import GraphModel

HELD = 0.25  # share of the record


class Heldout(NamedTuple):
    """Errors on the held-out rows by the spread of the followed sensor, and the rows that were fitted."""

    before: float
    after: float
    floor: float
    gain: float  # nats by which the best predicts them better, each under the noise of the rows before
    rows: tuple[int, int]
    fits: tuple[Fitted, Fitted]  # base and best, as the rows before were fitted
    late: Likelihood  # of the held-out rows

    @property
    def models(self) -> tuple[GraphModel, GraphModel]:
        """The models of both."""
        return self.fits[0].model, self.fits[1].model


def predict(base: Fitted, best: Fitted) -> Heldout:
    """Held-out error of the base and of the best model, each fitted to the rows before."""
    like = base.like
    first, late = like.split(HELD)
    fits = [refit(first, f.space, f.x, rounds=6) if f.space.names or f.space.hypotheses else f for f in (base, best)]
    return judged(like, late, (fits[0], fits[1]), first.rows)


def judged(whole: Likelihood, late: Likelihood, fits: tuple[Fitted, Fitted], rows: tuple[int, int]) -> Heldout:
    """Errors of the base and the best model on the rows of `late`, by the spread of each sensor on those of `whole`."""
    spread = whole.spread
    residuals = [late.raw(f.model) for f in fits]
    before, after = (float(np.sqrt(np.mean(np.mean(e**2, axis=0) / spread**2))) for e in residuals)
    floor = float(np.sqrt(np.mean(whole.least**2 * whole.mean / spread**2)))
    one, two = (late.foretold(e, f.like) for e, f in zip(residuals, fits, strict=True))
    return Heldout(before, after, min(floor, after), one - two, rows, fits, late)
