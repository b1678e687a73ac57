"""Finds the terms that a record asks for: screen all, fit the best few, build combinations of up to three.

A beam of models grows by one term a round. Each round screens every hypothesis on top of each model of the beam, fits
the likely ones roughly, the best of those in full, and keeps the best few, so that a pair whose first half looks like
something else is still found. Then what is no longer needed is taken out.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import Fit, Problem, fit, jacobian
from rtctl.diagnose.hypotheses import richer
from rtctl.diagnose.screen import Score, screen
from rtctl.diagnose.space import Hypothesis, Space

BEAM = (3, 2, 2)  # models that the next round builds on
LIKELY = (14, 9, 7)  # rough fits a model of the beam, by round
FULL = (5, 4, 3)  # full fits a round
FAR = 0.4  # of the base's cost: where two terms leave more, no third will do
STARTS = 3  # of one hypothesis that later rounds try
QUICK = 8  # rough fits where the model is already down to the noise
MOST = 3  # terms at once
ROUGH = 4  # rounds of a rough fit


class Search(NamedTuple):
    """All that was tried, best first within each number of terms."""

    base: Fit
    rounds: tuple[tuple[Fit, ...], ...]  # one term, two terms, three terms
    scores: tuple[Score, ...]  # of the first screening

    @property
    def fits(self) -> list[Fit]:
        """Every combination that was fitted, best first."""
        return sorted((f for r in self.rounds for f in r), key=lambda f: f.merit)


def names(fitted: Fit) -> tuple[str, ...]:
    """What a model consists of."""
    return tuple(sorted(h.name for h in fitted.space.hypotheses))


def search(
    problem: Problem,
    base: Fit,
    candidates: Sequence[Hypothesis],
    enough: Callable[[Fit], bool],
    worth: Callable[[Fit, Fit], bool],
    progress: Callable[[str], None] = lambda text: None,
) -> Search:
    """Grow models until a further term does not earn its place by `worth(before, after)`.

    Where a model is `enough`, down to the noise, one quick round looks for what may still hide beside it.
    """
    beam, sure = [base], enough(base)
    rounds: list[tuple[Fit, ...]] = []
    first: tuple[Score, ...] = ()
    for level in range(MOST):
        rough: dict[tuple[str, ...], Fit] = {}
        for parent in [*beam, at_owner(problem, base)] if level == 0 and not sure else beam:
            taken = set(names(parent))
            progress(
                f"screening {len(candidates)} hypotheses" + (f" beside {' and '.join(sorted(taken))}" * bool(taken))
            )
            scores = screen(problem, parent, [h for h in candidates if h.name not in taken])
            if level == 0 and not first:
                first = tuple(scores)
                candidates = best_starts(scores)
            for score in shortlist(scores, QUICK if sure else LIKELY[level]):
                trial = roughly(problem, parent, score)
                key = names(trial)
                if key not in rough or trial.cost < rough[key].cost:
                    rough[key] = trial
        ranked = sorted(rough.values(), key=lambda f: f.merit)[: 2 if sure else FULL[level]]
        if not ranked:
            break
        progress("fitting " + ", ".join(" + ".join(names(f)) for f in ranked[:3]))
        best = ranked[0].cost
        full = []
        for trial in ranked:
            fitted = from_both(problem, trial, best)
            best = min(best, fitted.cost)
            full.append(fitted)
        full.sort(key=lambda f: f.merit)
        wide = BEAM[level]
        full = [polish(problem, f) if f.cost < 6 * full[0].cost else f for f in full[:wide]] + full[wide:]
        full.sort(key=lambda f: f.merit)
        rounds.append(tuple(full))
        if not worth(beam[0], full[0]) or (level == 1 and full[0].cost > FAR * base.cost):
            break
        sure = enough(full[0])
        beam = full[:1] if sure else [f for f in full[:wide] if f.cost < 30 * full[0].cost]
    return Search(base, tuple(rounds), first)


def at_owner(problem: Problem, fitted: Fit) -> Fit:
    """The same terms with the owner's parameters: where a fit without the right term has run into its bounds, the
    owner is nearer to the truth."""
    x = fitted.x.copy()
    x[: fitted.space.nb] = 0.0
    r = problem.residual(fitted.space.model(x))
    J = jacobian(problem, fitted.space, x, r)
    return Fit(fitted.space, x, r, J, 0.5 * float(r @ r))


def from_both(problem: Problem, trial: Fit, best: float) -> Fit:
    """The better of two full fits: from where the trial stands, and from the owner's parameters."""
    one = fit(problem, trial.space, trial.x, rounds=16, J=trial.J, give_up=Hopeless(best))
    x = trial.x.copy()
    x[: trial.space.nb] = 0.0
    two = fit(problem, trial.space, x, rounds=16, give_up=Hopeless(min(best, one.cost)))
    return one if one.cost <= two.cost else two


def best_starts(scores: Sequence[Score]) -> list[Hypothesis]:
    """The best few starts of each hypothesis."""
    count: dict[str, int] = {}
    out = []
    for score in scores:
        name = score.hypothesis.name
        count[name] = count.get(name, 0) + 1
        if count[name] <= STARTS:
            out.append(score.hypothesis)
    return out


class Hopeless:
    """Whether a fit is far behind the best after some rounds."""

    def __init__(self, best: float, factor: float = 5.0, rounds: int = 4):
        self.best, self.factor, self.rounds, self.seen = best, factor, rounds, 0

    def __call__(self, cost: float) -> bool:
        """Count a round."""
        self.seen += 1
        return self.seen >= self.rounds and cost > self.factor * self.best


def polish(problem: Problem, fitted: Fit, rounds: int = 6) -> Fit:
    """Full rounds with a fresh Jacobian each, to the bottom."""
    return fit(problem, fitted.space, fitted.x, rounds=rounds, enough=2e-4)


def shortlist(scores: Sequence[Score], count: int) -> list[Score]:
    """The best scores, at most two starts of one hypothesis and at most three nodes of one term."""
    out: list[Score] = []
    for score in scores:
        h = score.hypothesis
        same = sum(s.hypothesis.name == h.name for s in out)
        nodes = len({s.hypothesis.node for s in out if s.hypothesis.term == h.term} - {h.node})
        if same < 2 and nodes < 3 and score.gain > 0:
            out.append(score)
        if len(out) == count:
            break
    return out


def roughly(problem: Problem, parent: Fit, score: Score) -> Fit:
    """A few cheap rounds: the parent's Jacobian for the plant's parameters, new columns for the hypothesis."""
    space: Space = parent.space.add(score.hypothesis)
    old = parent.J.shape[1]
    low, high = space.bounds()
    x = np.clip(score.x, low, high)
    r = problem.residual(space.model(x))
    new = jacobian(problem, space, x, r, range(old, len(x)))
    J = np.concatenate([parent.J, new], axis=1)
    return fit(problem, space, x, rounds=ROUGH, J=J, rough=True)


def eliminate(problem: Problem, found: Fit, worth: Callable[[Fit, Fit], bool]) -> Fit:
    """Take out, one by one, every term without which the model is as good."""
    while len(found.space.hypotheses) > 1:
        indices = range(len(found.space.hypotheses))
        trials = [fit(problem, found.space.without(i), drop(found, i), rounds=10) for i in indices]
        less = min(trials, key=lambda f: f.merit)
        if worth(less, found):
            return found
        found = less
    return found


def drop(found: Fit, index: int) -> np.ndarray:
    """x without the coordinates of one hypothesis."""
    parts = found.space.parts(found.x)
    return np.concatenate([found.x[: found.space.nb], *parts[:index], *parts[index + 1 :]])


def rivals(problem: Problem, found: Fit, index: int, candidates: Sequence[Hypothesis], most: int = 5) -> list[Fit]:
    """Full fits in which term `index` is replaced by each of the most likely others."""
    rest = fit(problem, found.space.without(index), drop(found, index), rounds=4)
    taken = {h.name for h in found.space.hypotheses}
    scores = shortlist(screen(problem, rest, [h for h in candidates if h.name not in taken]), 10)
    rough = sorted((roughly(problem, rest, score) for score in scores), key=lambda f: f.merit)
    best = [from_both(problem, f, found.cost) for f in rough[:most]]
    return sorted(best, key=lambda f: f.merit)


def enrich(problem: Problem, found: Fit, worth: Callable[[Fit, Fit], bool]) -> Fit:
    """Give each term its richer form (further harmonics, a second branch) where that takes enough off."""
    for index, h in enumerate(found.space.hypotheses):
        more = richer(problem.sim.record, found.model.base, h)
        if more is None:
            continue
        hypotheses = list(found.space.hypotheses)
        hypotheses[index] = more
        space = found.space._replace(hypotheses=tuple(hypotheses))
        parts = found.space.parts(found.x)
        parts[index] = np.concatenate([parts[index], more.start()[len(h.coordinates) :]])
        fitted = fit(problem, space, np.concatenate([found.x[: space.nb], *parts]), rounds=10)
        if worth(found, fitted):
            found = fitted
    return found
