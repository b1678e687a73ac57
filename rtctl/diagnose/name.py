"""Finds the terms that a record asks for: screen all, fit the best few, build combinations of up to three.

A beam of models grows by one term a round. Each round screens every hypothesis on top of each model of the beam, fits
the likely ones roughly, the best of those in full, and keeps the best few, so that a pair whose first half looks like
something else is still found. Then what is no longer needed is taken out.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose import decide, plausible
from rtctl.diagnose.fit import Fit, fit, jacobian, parallel
from rtctl.diagnose.hypotheses import hinted
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import enrich, polish, whole_orders
from rtctl.diagnose.rubbing import rubbing, soft
from rtctl.diagnose.scan import bumps, resonances, slack
from rtctl.diagnose.screen import Score, screen
from rtctl.diagnose.space import Hypothesis, Space
from rtctl.diagnose.stretches import loudness, usual
from rtctl.plants.physics import TERMS

FAR = 0.4  # of the base's cost: where two terms leave more, no third will do
CALMER = 0.8  # of the usual error: parameters that fit the quiet stretches this much better are a start of their own
ROBUST = 3  # rounds of weights
STARTS = 3  # of one hypothesis that later rounds try
MOST = 3  # terms at once
WAVES = ("turn", "wavelength", "per_turn")  # what a wave is as long as, or how often it comes
ROUGH = 4  # rounds of a rough fit
LESS, SHORTER = 3, 0.3  # steps back from a start that does worse than nothing, and how far each goes
RICHER, LIKELY = 3.0, 4  # times the best cost, up to which models are tried in richer forms, and how many of them


class Breadth(NamedTuple):
    """How broad a round is."""

    likely: int  # rough fits a model of the beam
    full: int  # full fits
    sure: int  # first in the screening of each model, which are fitted in full whatever their rough fit says
    keep: int  # models that the next round builds on


ROUNDS = (Breadth(14, 5, 2, 3), Breadth(9, 4, 0, 2), Breadth(7, 3, 0, 2))
ALIKE, NEAR = 1.01, 1.1  # times the cost: the same terms at other nodes do the same; one beside equal laws does
QUIET = 1.2  # times the noise floor: a heavy resonance leaves more
QUICK = Breadth(8, 2, 0, 2)  # where the model is already down to the noise


class Search(NamedTuple):
    """All that was tried, best first within each number of terms."""

    base: Fit
    rounds: tuple[tuple[Fit, ...], ...]  # one term, two terms, three terms
    scores: tuple[Score, ...]  # of the first screening
    sound: bool = True  # or the best of the first round is not, and nothing was built on it

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
    propose: Callable[[Fit], Sequence[Hypothesis]],
    enough: Callable[[Fit], bool],
    worth: Callable[[Fit, Fit], bool],
    progress: Callable[[str], None] = lambda text: None,
    sound: Callable[[Fit], bool] = lambda first: True,
    spent: Callable[[Fit], bool] = lambda best: False,
) -> Search:
    """Grow models until a further term does not earn its place by `worth(before, after)`, or `spent(best)` says that
    none can.

    `propose(model)` lists hypotheses with the starts that the record suggests once it is seen through that model.
    Where a model is `enough`, down to the noise, a quick round looks for what may still hide beside it, and only if
    there is something a broad one for what it is. Nothing is built on a first round whose best is not `sound`.
    """
    beam, sure = [base], enough(base)
    rounds: list[tuple[Fit, ...]] = []
    away = None if sure else elsewhere(problem, base)
    candidates = list(propose(base))
    known = {key(h) for h in candidates}
    first: tuple[Score, ...] = ()
    rubs = None if sure else rubbing(problem, base, candidates)
    if rubs is not None and worth(base, rubs):
        first, beam, away = tuple(screen(problem, base, candidates)), [rubs], None
        rounds, sure = [(rubs,)], enough(rubs)
    for level in range(MOST):
        if level > 0 or rounds:
            candidates = [*candidates, *new_starts(propose(beam[0]), known)]
        parents = [*beam, away] if level == 0 and away is not None else beam
        full, scores = grow(problem, parents, candidates, QUICK if sure else ROUNDS[level], away, enough, progress)
        if full and full[0].rms > decide.LOUD * problem.floor and level < MOST - 1 and not enough(full[0]):
            progress("looking for bumps")
            full = sorted(
                [*full, *(f for model in beam for f in bumps(problem, model, propose(model)))], key=absurd_last
            )
        if level == 0:
            first, candidates = first or tuple(scores), best_starts(scores)
            quiet = beam[0].rms < QUIET * problem.floor
            if not quiet and not (full and not sure and enough(full[0]) and worth(beam[0], full[0])):
                progress("looking for resonances")
                full = sorted([*full, *resonances(problem, beam[0], scores)], key=absurd_last)
            if not quiet and not (full and full[0].rms < decide.COMPLETE * problem.floor):
                full = sorted([*full, *soft(problem, beam[0], candidates)], key=absurd_last)
        elif problem.sim.case.controller.kind == "none" and not (full and enough(full[0])):  # most ring freely then
            progress(f"looking for resonances beside {' + '.join(names(beam[0]))}")
            further = [score for score in scores if score.hypothesis.name not in names(beam[0])]
            full = sorted([*full, *resonances(problem, beam[0], further)], key=absurd_last)
        tape = problem.sim.record.plant == "ivu" and level < MOST - 1
        if tape and beam[0].rms > decide.LOUD * problem.floor and not (full and enough(full[0])):
            progress("looking for a slack tape")
            full = sorted([*full, *(f for model in beam for f in slack(problem, model, scores))], key=absurd_last)
        if full and sure and worth(beam[0], full[0]):
            full, _ = grow(problem, parents, candidates, ROUNDS[level], away, enough, progress)
        if not full:
            break
        if level > 0:  # what wants to be something else is no ground to build on, however much it takes off
            full = sorted(full, key=partial(held, beam[0]))
        rounds.append(tuple(full))
        if level == 0 and not sound(full[0]):
            return Search(base, tuple(rounds), first, sound=False)
        if not worth(beam[0], full[0]) or (level == 1 and full[0].cost > FAR * base.cost):
            break
        if spent(full[0]):
            break
        sure = enough(full[0])
        beam = full[:1] if sure else [f for f in full[: ROUNDS[level].keep] if f.cost < 30 * full[0].cost]
    return Search(base, tuple(rounds), first)


def grow(
    problem: Problem,
    parents: Sequence[Fit],
    candidates: Sequence[Hypothesis],
    breadth: Breadth,
    away: Fit | None,
    enough: Callable[[Fit], bool],
    progress: Callable[[str], None],
) -> tuple[list[Fit], list[Score]]:
    """One term more on top of each parent: fits, best first, and the scores beside the first parent.

    Where a model is `enough`, what is far behind it is not tried from elsewhere.
    """
    rough: dict[tuple[str, ...], Fit] = {}
    likely: list[Fit] = []
    first: list[Score] = []
    for parent in parents:
        taken = set(names(parent))
        beside = f" beside {' and '.join(sorted(taken))}" * bool(taken)
        progress(f"screening {len(candidates)} hypotheses{beside}")
        scores = screen(problem, parent, [h for h in candidates if h.name not in taken])
        if not first:
            first, candidates = scores, best_starts(scores) if len(parents) > 1 and not taken else candidates
        own = parallel([partial(roughly, problem, parent, score) for score in shortlist(scores, breadth.likely)])
        likely += own[: breadth.sure]  # fitted in full, however bad the rough fit is
        for trial in own:
            if names(trial) not in rough or trial.cost < rough[names(trial)].cost:
                rough[names(trial)] = trial
        if own:  # what does best beside it, though other parents may have more that look better
            likely.append(min(own, key=lambda f: f.merit))
            if not taken and enough(likely[-1]):
                break
    ranked = various(sorted(rough.values(), key=lambda f: f.merit), breadth.full)
    if not ranked:
        return [], first
    progress("fitting " + ", ".join(" + ".join(names(f)) for f in ranked[:3]))
    ranked += [trial for trial in likely if not any(trial is f for f in ranked)]
    best, limit = min(f.cost for f in ranked), np.inf
    fits: dict[tuple, Fit] = {}
    for trial in ranked:
        fitted = from_both(problem, trial, best, None if away is None else away.x, limit * best)
        best = min(best, fitted.cost)
        limit = RICHER if enough(fitted) else limit
        kind = names(fitted), lengths(fitted)
        if kind not in fits or fitted.cost < fits[kind].cost:
            fits[kind] = fitted
    full = sorted(fits.values(), key=absurd_last)
    near = [f for i, f in enumerate(full) if i < breadth.keep or f.cost < RICHER * full[0].cost]
    near = various(near, max(breadth.keep, LIKELY) + len(near) - len({names(f) for f in near}))
    rest = [f for f in full if not any(f is n for n in near)]
    near = parallel([partial(finish, problem, f, f.cost < 6 * near[0].cost) for f in near])
    each: dict[tuple[str, ...], Fit] = {}
    for fitted in sorted([*near, *rest], key=absurd_last):
        each.setdefault(names(fitted), fitted)
    return list(each.values()), first


def lengths(fitted: Fit) -> tuple[int, ...]:
    """What tells the waves of a model from others of the same terms, to a tenth: a plain wave that is not there may do
    better than the plain form of one that is, whose harmonics are its own."""
    found = [
        h.values(x)[c.name]
        for h, x in zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True)
        for c in h.coordinates
        if c.name in WAVES
    ]
    return tuple(round(10 * float(np.log(value))) for value in found)


def finish(problem: Problem, fitted: Fit, close: bool) -> Fit:
    """To the bottom, if it is `close` to the best, and in a richer form where more than noise is left."""
    if close:
        fitted = whole_orders(problem, polish(problem, fitted))
    return enrich(problem, fitted, decide.better) if fitted.rms > decide.COMPLETE * problem.floor else fitted


def various(ranked: Sequence[Fit], count: int) -> list[Fit]:
    """The first `count` that are not the same terms doing the same at other nodes, nor the same further term doing the
    same beside another of equal laws; those only of the very first."""
    kinds: list[tuple[list[str], str, float]] = []
    out = []
    for trial in ranked:
        terms = sorted(h.term for h in trial.space.hypotheses)
        last = trial.space.hypotheses[-1].name if len(terms) > 1 else ""
        same = [
            i
            for i, (other, more, cost) in enumerate(kinds)
            if (other == terms and trial.cost < ALIKE * cost) or (more == last != "" and trial.cost < NEAR * cost)
        ]
        if not same:
            if len(kinds) == count:
                break
            kinds.append((terms, last, trial.cost))
        if not same or same[0] == 0:
            out.append(trial)
    return out


def absurd_last(fitted: Fit) -> tuple[bool, float]:
    """What models are ordered by: a size that no machine has, or nobody misses, may follow what real terms do."""
    return plausible.unlikely(fitted), fitted.merit


def held(before: Fit, after: Fit) -> tuple[bool, bool]:
    """What models of a round come after the others by: a size that is not one to find, then a shape at its end."""
    return plausible.unlikely(after), decide.at_end(before, after)


def elsewhere(problem: Problem, base: Fit) -> Fit:
    """The base model with other parameters, nearer to the truth where what is missing has pulled them away.

    Those that fit the quiet stretches of the record if they fit them clearly better; else the owner's.
    """
    calm = calm_fit(problem, base)
    x = calm.x if usual(calm.r) < CALMER * usual(base.r) else np.zeros_like(base.x)
    return Fit(base.space, x, *at(problem, base.space, x))


def at(problem: Problem, space: Space, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Residual, Jacobian and cost there."""
    r = problem.residual(space.model(x))
    return r, jacobian(problem, space, x), 0.5 * float(r @ r)


def calm_fit(problem: Problem, fitted: Fit) -> Fit:
    """A fit in which loud stretches count for little, so that an effect at some moments pulls at nothing else.

    Source: Holland & Welsch, Robust regression by iteratively reweighted least squares (1977), Cauchy weights, here of
    the rms of a stretch.
    """
    J = fitted.J
    for _ in range(ROBUST):
        loud = loudness(fitted.r)
        calm = problem.weighed(1.0 / np.sqrt(1.0 + (loud / (2.0 * usual(fitted.r))) ** 2))
        x = fitted.x
        found = fit(calm, fitted.space, x, rounds=4, J=J * (calm.weights / problem.weights)[:, None])
        J = found.J / (calm.weights / problem.weights)[:, None]
        fitted = Fit(fitted.space, found.x, problem.residual(fitted.space.model(found.x)), J, found.cost)
    return fitted


def from_both(problem: Problem, trial: Fit, best: float, other: np.ndarray | None = None, limit: float = np.inf) -> Fit:
    """The better of two full fits: from where the trial stands, and from other plant parameters, else the owner's; the
    second only if the first comes below the `limit`."""
    x = trial.x.copy()
    x[: trial.space.nb] = 0.0 if other is None else other[: trial.space.nb]
    one, two = (partial(well, problem, trial, start, best) for start in (trial.x, x))
    if limit == np.inf:
        fits = parallel([one, two])
    else:
        fits = [one()]
        if fits[0].cost <= limit:
            fits.append(two())
    return min(fits, key=lambda f: f.cost)


def well(problem: Problem, trial: Fit, x: np.ndarray, best: float) -> Fit:
    """A full fit of a trial's model from `x`, as long as it may come near the cost of the best."""
    return fit(problem, trial.space, x, rounds=16, J=trial.J, give_up=Hopeless(best))


def more_starts(term: str) -> int:
    """Starts of a term that are kept beyond the usual number: of orders that pass slowly at a few places only, a look
    shows little."""
    return TERMS[term].more_starts if term in TERMS else 0


def best_starts(scores: Sequence[Score]) -> list[Hypothesis]:
    """The best few starts of each hypothesis."""
    count: dict[str, int] = {}
    out = []
    for score in scores:
        name = score.hypothesis.name
        count[name] = count.get(name, 0) + 1
        if count[name] <= STARTS + more_starts(score.hypothesis.term):
            out.append(score.hypothesis)
    return out


def new_starts(proposed: Sequence[Hypothesis], known: set[tuple]) -> list[Hypothesis]:
    """Those of the proposed that were not proposed before: by what the record suggests through the model so far, or
    because they ask for what it has by now. `known` is kept up to date."""
    before = {name for name, *_ in known}
    new = [h for h in proposed if (hinted(h.term) or h.name not in before) and key(h) not in known]
    known.update(key(h) for h in proposed)
    return new


def key(h: Hypothesis) -> tuple:
    """What tells a hypothesis and its start from another."""
    return (
        h.name,
        str(sorted(h.fixed.items())),
        tuple((round(c.scale, 12), round(c.offset, 12)) for c in h.coordinates),
    )


class Hopeless:
    """Whether a fit is far behind the best after some rounds."""

    def __init__(self, best: float, factor: float = 5.0, rounds: int = 4):
        self.best, self.factor, self.rounds, self.seen = best, factor, rounds, 0

    def __call__(self, cost: float) -> bool:
        """Count a round."""
        self.seen += 1
        return self.seen >= self.rounds and cost > self.factor * self.best


def shortlist(scores: Sequence[Score], count: int) -> list[Score]:
    """The best scores, at most two starts of one hypothesis (of a ripple more, beside the count) and at most three
    nodes of one term."""
    out: list[Score] = []
    more = 0
    for score in scores:
        h = score.hypothesis
        same = sum(s.hypothesis.name == h.name for s in out)
        nodes = len({s.hypothesis.node for s in out if s.hypothesis.term == h.term} - {h.node})
        if same < 2 + more_starts(h.term) and nodes < 3 and score.gain > 0:
            out.append(score)
            more += same >= 2
        if len(out) - more == count:
            break
    return out


def roughly(problem: Problem, parent: Fit, score: Score) -> Fit:
    """A few cheap rounds: the parent's Jacobian for what it has, new columns for the hypothesis.

    They begin where the score has moved the parent's parameters to or where they were, whichever is better; where both
    are worse than the parent, which has none of it, with less of it.
    """
    space: Space = parent.space.add(score.hypothesis)
    old = parent.J.shape[1]
    starts = [np.clip(score.x, *space.bounds())]
    starts.append(np.concatenate([parent.x, starts[0][old:]]))

    def cost(x: np.ndarray) -> float:
        return float(np.sum(problem.residual(space.model(x), coarse=True) ** 2))

    costs = [cost(x) for x in starts]
    for _ in range(LESS):
        if min(costs) <= 2.0 * parent.cost:
            break
        x = starts[-1].copy()
        x[old:][score.hypothesis.sizes] *= SHORTER
        starts.append(x)
        costs.append(cost(x))
    x = starts[int(np.argmin(costs))]
    J = np.concatenate([parent.J, jacobian(problem, space, x, range(old, len(x)))], axis=1)
    return fit(problem, space, x, rounds=ROUGH, J=J, rough=True)
