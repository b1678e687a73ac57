"""Shrinkage of a model to the numbers that predict, before it is written.

A size that the record hardly determines moves the prediction of another day by its error, and gains nothing. It is
left out where its interval nearly holds zero and its gain does not repeat on quarters of the record that no fit saw: a
free run, which adds up a constant error, has to gain by it in nearly all of them, and so has the tracking error.

Source: Hastie, Tibshirani & Friedman, The Elements of Statistical Learning (2009), 7.10 for cross-validation.
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.heldout import QUARTERS, repeated, runs_better
from rtctl.diagnose.numbers import nice
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import exchanged, swapped
from rtctl.diagnose.space import COSINE, SIZE, Hypothesis
from rtctl.diagnose.uncertainty import Z90, covariance, parameter_unit, with_form

DOUBTFUL = 3.0  # standard deviations from zero, below which a size has to repeat
REPEATS = 0.5  # share of the gain on fitted errors that unseen ones have to show
MOST = 3  # quarters of four in which the free run has to gain


class Shrunk(NamedTuple):
    """A model for prediction, and a sentence on each number that it does without."""

    fitted: Fit
    reasons: tuple[str, ...]


def shrunk(problem: Problem, fitted: Fit) -> Shrunk:
    """The fit without sizes that are doubtful and do not repeat, the others fitted anew; the least sure size first."""
    reasons: list[str] = []
    kept: set[str] = set()
    while True:
        found = doubtful(problem, fitted, kept)
        if found is None:
            return Shrunk(fitted, tuple(reasons))
        index, at, sigma = found
        h = fitted.space.hypotheses[index]
        name = h.coordinates[at].name.partition("|")[0]
        less = without(problem, fitted, index, at)
        better = runs_better(problem, less, fitted)
        if better >= MOST and repeated(problem, less, fitted) >= REPEATS:
            kept.add(f"{h.name}.{name}")
            continue
        value = h.values(fitted.space.parts(fitted.x)[index])[name] - h.coordinates[at].offset
        unit = parameter_unit(fitted.model, h, name)
        size, half = (nice(x, unit) if unit else f"{x:.2g}" for x in (value, Z90 * sigma))
        reasons.append(
            f"{h.term} at {h.node}, {name}: the record says {size} +- {half} (90 %), and a free run on rows that no "
            f"fit saw was better with it in {better} of {QUARTERS} quarters"
        )
        fitted = less


def doubtful(problem: Problem, fitted: Fit, kept: set[str]) -> tuple[int, int, float] | None:
    """Index of the hypothesis and of its size nearest to zero in standard deviations, and that deviation in the size's
    own unit; None where all are sure or in `kept`."""
    cov = with_form(fitted, covariance(fitted, problem.block))
    worst, found = DOUBTFUL, None
    for index, (h, x) in enumerate(zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True)):
        columns = fitted.space.columns(index)
        for at, c in enumerate(h.coordinates):
            if c.kind not in (SIZE, COSINE) or f"{h.name}.{c.name.partition('|')[0]}" in kept:
                continue
            pair = [at, at + 1] if c.kind == COSINE else [at]
            own = cov[np.ix_(columns[pair], columns[pair])]
            size = x[pair]
            away = float(np.sqrt(max(size @ np.linalg.pinv(own) @ size, 0.0)))
            if away < worst:
                worst, found = away, (index, at, c.scale * float(np.sqrt(np.trace(own) / len(pair))))
    return found


def without(problem: Problem, fitted: Fit, index: int, at: int) -> Fit:
    """The model fitted with one size of a hypothesis at zero, or without the hypothesis where it has no other size."""
    h, x = fitted.space.hypotheses[index], fitted.space.parts(fitted.x)[index]
    gone = [at, at + 1] if h.coordinates[at].kind == COSINE else [at]
    if set(h.sizes) <= set(gone):
        start = np.delete(fitted.x, fitted.space.columns(index))
        return fit(problem, fitted.space.without(index), start, rounds=10)
    less = pinned(h, gone)
    return fit(problem, exchanged(fitted, index, less), swapped(fitted, index, np.delete(x, gone)), rounds=10)


def pinned(h: Hypothesis, gone: list[int]) -> Hypothesis:
    """The hypothesis with some of its sizes where the effect is none."""
    values = {name: h.coordinates[i].offset for i in gone for name in h.coordinates[i].name.split("|")}
    rest = tuple(c for i, c in enumerate(h.coordinates) if i not in gone)
    return h._replace(coordinates=rest, fixed={**h.fixed, **values})
