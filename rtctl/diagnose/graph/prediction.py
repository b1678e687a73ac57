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
    rows: tuple[int, int]
    models: tuple[GraphModel, GraphModel]  # base and best, as the rows before were fitted
    late: Likelihood  # of the held-out rows


def predict(base: Fitted, best: Fitted) -> Heldout:
    """Held-out error of the base and of the best model, each fitted to the rows before."""
    like = base.like
    first, late = like.split(HELD)
    models = [
        f.space.model(refit(first, f.space, f.x, rounds=6).x) if f.space.names or f.space.hypotheses else f.model
        for f in (base, best)
    ]
    return judged(like, late, (models[0], models[1]), first.rows)


def judged(
    whole: Likelihood, late: Likelihood, models: tuple[GraphModel, GraphModel], rows: tuple[int, int]
) -> Heldout:
    """Errors of the base and the best model on the rows of `late`, by the spread of each sensor on those of `whole`."""
    spread = whole.spread
    before, after = (float(np.sqrt(np.mean(np.mean(late.raw(m) ** 2, axis=0) / spread**2))) for m in models)
    floor = float(np.sqrt(np.mean(whole.least**2 * whole.mean / spread**2)))
    return Heldout(before, after, min(floor, after), rows, models, late)
