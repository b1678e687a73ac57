"""Start of a search: the fitted base, the times of the ticks, and models with one effect.

A fit with one effect may lead to a higher maximum of the base: the base is refitted from the parameters of that fit.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import FIRST
from rtctl.diagnose.likelihood.clock import clock, timed
from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.search.description_errors import inexact
from rtctl.diagnose.search.enrich import restarted
from rtctl.diagnose.search.extend import extended, screened
from rtctl.diagnose.search.first_look import first_look
from rtctl.diagnose.search.screen import Screened
from rtctl.diagnose.search.standing import merit_of

NAMES = 8  # terms that are fitted as the first effect
ROUNDS = 3  # of the base and of the first effect
LEADS = 3  # best models with one effect, from whose parameters the base is refitted
MORE = 1.0  # nats: least gain of evidence of a refitted base

Progress = Callable[[str], None]


class Begun(NamedTuple):
    """Start of a search: base, models with one effect, screening scores and prior odds."""

    base: Fitted
    grown: list[Fitted]  # models with one effect
    looked: Screened  # screening scores beside the base
    odds: float  # ln of the prior odds of one effect at one place

    @property
    def order(self) -> tuple[Fitted, ...]:
        """The base and the models with one effect, by posterior."""
        return tuple(sorted((self.base, *self.grown), key=partial(merit_of, odds=self.odds), reverse=True))


def begun(like: Likelihood, space: Space, progress: Progress) -> Begun:
    """The base, models with one effect, the screening scores beside the base, and the prior odds of one effect."""
    progress("fitting the nominal parameters")
    base = refit(like, space)
    progress(first_look(base))
    base = restarted(base)
    told = clock(base, 0.0)
    if told.gain > 0.0:
        progress("estimating the times of the ticks")
        held = refit(timed(base, told), space, base.x)
        if held.log_evidence > base.log_evidence + MORE:
            like, base = held.like, held
    base = inexact(base)
    like = base.like
    for _ in range(ROUNDS):
        progress("screening every hypothesis")
        looked = screened(base)
        odds = float(np.log(max(len({score.hypothesis.name for score in looked.scores}), 1)))
        progress("fitting effect 1")
        grown = extended(like, [base], {(): base}, NAMES, partial(merit_of, odds=odds), [looked])
        before, base = base, rebased(base, grown)
        if base.log_evidence < before.log_evidence + FIRST:
            break
    return Begun(base, grown, looked, odds)


def rebased(base: Fitted, grown: Sequence[Fitted]) -> Fitted:
    """Base with the highest evidence, also refitted from the parameters of the best models with one effect.

    The likelihood may have several maxima: an effect may lead the fit to a higher maximum of the base.
    """
    for f in sorted(grown, key=lambda f: f.loss)[:LEADS]:
        if f.loss < base.loss - FIRST:
            again = refit(base.like, *without(f, 0))
            if again.log_evidence > base.log_evidence + MORE:
                base = again
    return base
