"""Takes a model that was found in hand: to the bottom of its fit, in richer forms, without what it does not need."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from rtctl.diagnose import decide
from rtctl.diagnose.fit import Fit, fit, parallel
from rtctl.diagnose.forms import about_others, as_harmonic, forms, moved_into, of_first_order, richer, rounded
from rtctl.diagnose.hypotheses import FALLING
from rtctl.diagnose.model import ADDS_DRY, dry_friction
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.scales import node_scales
from rtctl.diagnose.space import Hypothesis, Space

LITTLE = 0.05  # of what a name takes off: a richer form that takes all but this does as well
IN_REACH = 3.0  # times the cost: models beyond it no richer form brings there


def polish(problem: Problem, fitted: Fit, rounds: int = 6) -> Fit:
    """Full rounds with a fresh Jacobian each, to the bottom."""
    return fit(problem, fitted.space, fitted.x, rounds=rounds, enough=2e-4, J=fitted.J)


def whole_orders(problem: Problem, fitted: Fit) -> Fit:
    """With orders that are next to a whole number at that number, where this costs little: a ripple whose order is off
    by a thousandth is out of step where the record has not been."""
    for index, (h, x) in enumerate(zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True)):
        found = rounded(h, x)
        if found is None:
            continue
        at = int(fitted.space.columns(index)[found[0]])
        J = np.delete(fitted.J, at, axis=1)
        other = fit(problem, exchanged(fitted, index, found[1]), np.delete(fitted.x, at), rounds=6, J=J)
        if other.merit < fitted.merit:
            fitted = other
    return fitted


def eliminate(problem: Problem, found: Fit, worth: Callable[[Fit, Fit], bool]) -> Fit:
    """Take out, one by one, every term without which the model is as good, in another of its forms if need be.

    A richer form that does as well as a further name is the smaller claim, whatever its numbers.
    """
    while len(found.space.hypotheses) > 1:
        found = plainer(problem, found)
        indices = [i for i in range(len(found.space.hypotheses)) if not bears(found, i)]
        trials = parallel([partial(dropped, problem, found, i, 10) for i in indices])
        less = min(trials, key=lambda f: f.merit)
        if less.cost < IN_REACH * found.cost:
            richest = enrich(problem, less, lambda before, after: after.cost < before.cost)
            if richest.cost < found.cost + LITTLE * (less.cost - found.cost):
                found = richest
                continue
        if less.rms > decide.COMPLETE * problem.floor:
            less = enrich(problem, less, decide.better)
        if worth(less, found):
            return found
        found = less
    return found


def bears(found: Fit, index: int) -> bool:
    """Whether another term stands on one: friction that falls with speed falls to dry friction, the owner's or this."""
    h = found.space.hypotheses[index]
    falls = any((other.term, other.node) == (FALLING, h.node) for other in found.space.hypotheses)
    return h.term == ADDS_DRY and falls and not dry_friction(found.model.kind, found.model.base, h.node)


def dropped(problem: Problem, found: Fit, index: int, rounds: int) -> Fit:
    """The model fitted without one of its hypotheses."""
    J = np.delete(found.J, found.space.columns(index), axis=1)
    return fit(problem, found.space.without(index), drop(found, index), rounds=rounds, J=J)


def drop(found: Fit, index: int) -> np.ndarray:
    """x without the coordinates of one hypothesis."""
    return np.delete(found.x, found.space.columns(index))


def enrich(problem: Problem, found: Fit, worth: Callable[[Fit, Fit], bool]) -> Fit:
    """Give each term another form of the same, or a richer one (harmonics, a second branch), where that is better."""
    for index, h in enumerate(found.space.hypotheses):
        found = reformed(problem, found, index, (*forms(h), *about_others(problem.sim.record, found.model.base, h)))
        more = richer(problem.sim.record, found.model.base, found.space.hypotheses[index])
        if more is None:
            continue
        own = np.concatenate([found.space.parts(found.x)[index], more.start()[len(h.coordinates) :]])
        scales = node_scales(problem.sim.record, found.model.base)
        span = (scales.get(h.node) or next(iter(scales.values()))).span
        starts = ((more, own), *as_harmonic(more, own, span))
        tried = parallel([partial(with_other, problem, found, index, f, x, 12) for f, x in starts])
        fitted = min(tried, key=lambda f: f.merit)
        if worth(found, fitted):
            # forms between which the plain one may know no difference
            found = reformed(problem, fitted, index, forms(fitted.space.hypotheses[index]))
    return found


def plainer(problem: Problem, found: Fit) -> Fit:
    """The model with a plain form again of what a fit has led to the end of its richer one, where that is better."""
    for index, (h, x) in enumerate(zip(found.space.hypotheses, found.space.parts(found.x), strict=True)):
        less = of_first_order(h, x)
        if less is not None:
            found = min(found, with_other(problem, found, index, *less, 12), key=lambda f: f.merit)
    return found


def reformed(problem: Problem, found: Fit, index: int, others: Sequence[Hypothesis]) -> Fit:
    """The model with the best of the `others`, forms of hypothesis `index`, in its place where one is better."""
    for form in others:
        for start in moved_into(form, found.space.parts(found.x)[index]):
            other = with_other(problem, found, index, form, start, 10, found.J)
            if other.merit < found.merit:
                found = other
    return found


def with_other(
    problem: Problem, found: Fit, index: int, h: Hypothesis, start: np.ndarray, rounds: int, J: np.ndarray | None = None
) -> Fit:
    """The model fitted with `h`, from `start`, in the place of hypothesis `index`."""
    return fit(problem, exchanged(found, index, h), swapped(found, index, start), rounds, J=J)


def placed(problem: Problem, found: Fit, index: int, h: Hypothesis, x: np.ndarray) -> np.ndarray:
    """Residual of the model with `h` at `x` in the place of hypothesis `index`, and nothing else moved."""
    return problem.residual(exchanged(found, index, h).model(swapped(found, index, x)))


def swapped(found: Fit, index: int, x: np.ndarray) -> np.ndarray:
    """x of the model with the coordinates of hypothesis `index` replaced."""
    parts = found.space.parts(found.x)
    parts[index] = x
    return np.concatenate([found.x[: found.space.nb], *parts])


def exchanged(found: Fit, index: int, h: Hypothesis) -> Space:
    """The space with hypothesis `index` replaced."""
    hypotheses = list(found.space.hypotheses)
    hypotheses[index] = h
    return found.space._replace(hypotheses=tuple(hypotheses))
