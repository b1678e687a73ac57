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
    begin, end = like.rows
    cut = end - round(HELD * (end - begin))
    first, late = like.during(begin, cut), like.during(cut, end)
    spread = np.std(like.target[begin:end], axis=0)
    spread = np.where(spread > 0.0, spread, 1.0)
    errors, models = [], []
    for f in (base, best):
        x = refit(first, f.space, f.x, rounds=6).x if f.space.names or f.space.hypotheses else f.x
        models.append(f.space.model(x))
        e = late.raw(models[-1])
        errors.append(float(np.sqrt(np.mean((np.sqrt(np.mean(e**2, axis=0)) / spread) ** 2))))
    least = like.least * np.sqrt(like.mean) / spread
    floor = float(np.sqrt(np.mean(least**2)))
    return Heldout(errors[0], errors[1], min(floor, errors[1]), (begin, cut), (models[0], models[1]), late)
