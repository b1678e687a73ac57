"""Held-out prediction: models fitted to the first rows of a record, judged on the last rows under the observer."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import WORSE
from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.model import GraphModel

HELD = 0.25  # share of the rows that are held out
ROUNDS = 6  # Gauss-Newton steps of a fit to the early rows


class Heldout(NamedTuple):
    """Residual rms on the held-out rows by the spread of each sensor, and the fits to the early rows."""

    before: float
    after: float
    floor: float
    gain: float  # nats of the best model over the base on the held-out rows, each under its noise of the early rows
    fits: tuple[Fitted, Fitted]  # base and best, fitted to the early rows
    early: Likelihood  # of the early rows
    late: Likelihood  # of the held-out rows

    @property
    def rows(self) -> tuple[int, int]:
        """First fitted row, and first held-out row."""
        return self.early.rows

    @property
    def models(self) -> tuple[GraphModel, GraphModel]:
        """Models of the base and of the best."""
        return self.fits[0].model, self.fits[1].model


def predict(base: Fitted, best: Fitted, fewer: bool = False) -> tuple[Heldout, Fitted]:
    """Held-out errors of the base and the best model, each fitted to the early rows, and the best model; with `fewer`,
    without effects that worsen the held-out prediction."""
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
    """Gain in nats of model `one` over model `other` on the rows of `late`, each under its noise of the early rows.

    Each model comes with its residuals (blocks, sensors) on `late`.

    A model with a small white residual on the early rows loses by slow errors on later rows to a model with a large
    coloured residual. Both are therefore also compared under the noise of model `one`; a clear gain there counts.
    """
    (first, e), (second, f) = one, other
    told = late.foretold(e, first.like)
    own, nearer = late.foretold(f, second.like) - told, late.foretold(f, first.like) - told
    return max(own, nearer) if nearer > WORSE else own


def predicted(heldout: Heldout, best: Fitted) -> Heldout:
    """Held-out errors with another best model."""
    early, late = heldout.early, heldout.late
    return judged(best.like, early, late, (heldout.fits[0], fitted_to(early, best)))


def fitted_to(rows: Likelihood, f: Fitted) -> Fitted:
    """Model refitted to some rows from its present unknowns; unchanged where it has no unknowns."""
    return refit(rows, f.space, f.x, rounds=ROUNDS) if f.space.names or f.space.hypotheses else f


def judged(whole: Likelihood, early: Likelihood, late: Likelihood, fits: tuple[Fitted, Fitted]) -> Heldout:
    """Held-out errors of the base and the best model on the rows of `late`, by the spread of each sensor on `whole`."""
    spread = whole.spread
    residuals = [late.raw(f.model) for f in fits]
    before, after = (float(np.sqrt(np.mean(np.mean(e**2, axis=0) / spread**2))) for e in residuals)
    floor = float(np.sqrt(np.mean(whole.least**2 * whole.mean / spread**2)))
    gain = ahead(late, (fits[1], residuals[1]), (fits[0], residuals[0]))
    return Heldout(before, after, min(floor, after), gain, fits, early, late)
