"""What a record asks for: base fit, search, the rivals of what was found, and nothing in doubt that is not needed."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from rtctl.diagnose import beyond, decide
from rtctl.diagnose.base import base_fit
from rtctl.diagnose.faint import faint
from rtctl.diagnose.fit import Fit, fit, parallel
from rtctl.diagnose.forms import is_rich, renamed
from rtctl.diagnose.hints import hints
from rtctl.diagnose.hypotheses import USUAL, hypotheses
from rtctl.diagnose.jitter import Jitter, allowed_for, jitter, pushed
from rtctl.diagnose.name import Search, absurd_last, names, search
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import dropped, eliminate, enrich, exchanged, placed, polish, with_other
from rtctl.diagnose.rivals import look_alikes, rivals
from rtctl.diagnose.rubbing import bare
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.stretches import rms
from rtctl.diagnose.verdict import Alternative, standing, weights
from rtctl.plants.physics import TERMS

CLOSE = 1.3  # times the best cost: a rival this near may be ahead in its richer form
CLEARLY = 0.5  # of the best cost: what a richer form must come down to, to take its place
RICH = 10.0  # the same, of one that is tried in its richer form because the best is in it
EQUAL = 1.02  # times the best cost: equally good
NEAR = 2.0  # times the best cost: a rival this near is fitted to the bottom
SPARED = 1.5  # times the best cost: what a model may come to when it loses a term in doubt
DOUBTFUL = 0.7  # weight among its rivals, of a name that the model may have to do without
MOST = 4  # rivals of one hypothesis
Progress = Callable[[str], None]
Sound = Callable[[Problem, Fit], bool]
Places = tuple[tuple[Alternative, ...], ...]


class Found(NamedTuple):
    """What the search came to."""

    problem: Problem
    jitter: Jitter | None  # of the ticks
    base: Fit
    best: Fit
    search: Search
    rivals: tuple[tuple[Alternative, ...], ...]  # for each hypothesis of the best, fits with another in its place
    beyond: Fit | None = None  # in which a law without a name does better than names that it resembles

    def bare(self) -> "Found":
        """The same without any term."""
        return self._replace(problem=self.problem.weighed_in(None), best=self.base, rivals=(), beyond=None)


def quiet(text: str) -> None:
    """Say nothing."""


def any_model(problem: Problem, first: Fit) -> bool:
    """Trust it."""
    return True


def find(
    sim: Simulator, problem: Problem, progress: Progress = quiet, base: Fit | None = None, sound: Sound = any_model
) -> Found:
    """Base fit, unless it is given, search, and the rivals of what it found.

    It ends after the first round where the best model is not `sound`: then the record is to be looked at otherwise.
    """
    if base is None:
        progress("fitting the nominal parameters")
        base = base_fit(sim, problem)
    off = jitter(sim, base.model, problem.rows)
    if off is not None:
        problem = allowed_for(problem, base.model, off)
        base = base_fit(sim, problem)
        if off.told:
            held = problem.of(pushed(sim, base.model, off))
            other = base_fit(held.sim, held)
            if other.cost < base.cost:
                sim, problem, base = held.sim, held, other
        else:
            off = None
    worth = partial(decide.worth, problem, base)
    propose = partial(proposed, sim)

    def trusted(first: Fit) -> bool:
        return not worth(base, first) or sound(problem, first)

    enough, spent = partial(decide.complete, problem, base), partial(decide.spent, problem, base)
    looked = search(problem, base, propose, enough, worth, progress, trusted, spent)
    if not looked.sound:
        return Found(problem, off, base, looked.rounds[0][0], looked, ())
    best = base
    for level in looked.rounds:
        if worth(best, level[0]):
            best = level[0]
    needed = partial(missed, problem, base) if bare(base) else worth
    if len(best.space.hypotheses) > 1:
        best = polish(problem, eliminate(problem, best, needed))
    candidates = propose(base)
    hidden = None if best.space.hypotheses else faint(problem, base, candidates, progress)
    if hidden is not None:
        looked = looked._replace(rounds=(*looked.rounds, hidden.fits))
        best = hidden.fits[0]
        near = replacements(hidden.problem, best, looked, candidates, progress)
        return Found(hidden.problem, off, base, best, looked, near)
    near = replacements(problem, best, looked, candidates, progress)
    others = [place.fit for places in near for place in places]
    if best.rms > decide.COMPLETE * problem.floor and best.space.hypotheses:
        close = [best, *(f for f in others if f.cost < CLOSE * best.cost)]
        others += [f for f in (enrich(problem, f, decide.better) for f in close) if f.cost < CLEARLY * best.cost]
    ahead = min(others, key=absurd_last, default=best)
    looked = looked._replace(rounds=(*looked.rounds, (best, *others)))  # what came out second is a rival of the first
    if absurd_last(ahead) < absurd_last(best):  # a rival came out ahead once it was fitted to the bottom
        best = polish(problem, eliminate(problem, ahead, needed))  # beside it another may be needed no more
        near = replacements(problem, best, looked, resembling(candidates, best), progress)
    likelier = most_likely(problem, best, near)
    if likelier is not best:
        best, near = likelier, replacements(problem, likelier, looked, (), progress)
    best, near = without_doubtful(problem, best, looked, near, progress)
    best, near = usual_nodes(sim.record.plant, best, near)
    return Found(problem, off, base, best, looked, near, beyond.nameless(problem, base, best, progress))


def missed(problem: Problem, base: Fit, before: Fit, after: Fit) -> bool:
    """Whether `after` is worth its further term, or may be told and `before` not: the frictions that an owner wrote
    nothing of are several, and what the form of one misses may well be another."""
    told = partial(decide.enough, problem, base)
    return decide.worth(problem, base, before, after) or (told(after) and not told(before))


def resembling(candidates: Sequence[Hypothesis], best: Fit) -> list[Hypothesis]:
    """Those of the candidates that look like a term of the best model: the search need not have met them beside the
    others of a model that it did not end with."""
    alike = {name for h in best.space.hypotheses for name in TERMS[h.term].look_alikes}
    return [h for h in candidates if h.term in alike]


def most_likely(problem: Problem, best: Fit, near: Places) -> Fit:
    """Of models that explain the record equally well, the one with fewer numbers and the more usual sizes."""
    for index, places in enumerate(near):
        all_of_them = [Alternative(best, index), *places]
        likeliest = int(weights(problem, all_of_them).argmax())
        if likeliest > 0:
            return all_of_them[likeliest].fit
    return best


def usual_nodes(plant: str, best: Fit, near: Places) -> tuple[Fit, Places]:
    """Of nodes that move together, and at which a term does equally well, the one where it usually stands."""
    for places in near:
        for k, place in enumerate(places):
            own = {h.term: h.node for h in best.space.hypotheses}.get(place.hypothesis.term)
            swap = own is not None and (plant, place.hypothesis.node) in USUAL and (plant, own) not in USUAL
            same = sorted(h.term for h in place.fit.space.hypotheses) == sorted(h.term for h in best.space.hypotheses)
            if swap and same and place.fit.cost < EQUAL * best.cost:
                at = next(i for i, h in enumerate(best.space.hypotheses) if h.term == place.hypothesis.term)
                others = [p for j, p in enumerate(places) if j != k]
                changed = list(near)
                changed[near.index(places)] = (Alternative(best, at), *others)
                return place.fit, in_order(place.fit, best, tuple(changed))
    return best, near


def in_order(fitted: Fit, before: Fit, near: Places) -> Places:
    """The rivals of each hypothesis, in the order of `fitted`, of the same terms as `before`."""
    by_term = {h.term: places for h, places in zip(before.space.hypotheses, near, strict=True)}
    return tuple(by_term[h.term] for h in fitted.space.hypotheses)


def without_doubtful(
    problem: Problem, best: Fit, looked: Search, near: Places, progress: Progress
) -> tuple[Fit, Places]:
    """Leave out what others could stand in for as well, as long as the rest explains enough without it, and not much
    less: of what is surely there it is better to say that it has one of two names."""
    while len(best.space.hypotheses) > 1 and decide.enough(problem, looked.base, best):
        sure = [standing(problem, best, i, places) for i, places in enumerate(near)]
        weakest = min(range(len(sure)), key=lambda i: sure[i])
        if sure[weakest] >= DOUBTFUL:
            break
        less = dropped(problem, best, weakest, 10)
        if less.cost > SPARED * best.cost:
            less = enrich(problem, less, decide.better)
        if less.cost > SPARED * best.cost or not decide.enough(problem, looked.base, less):
            break
        best = polish(problem, less)
        near = replacements(problem, best, looked, (), progress)
    return best, near


def with_fewer(found: Found, index: int | None = None) -> Found:
    """The same without the term `index`, or without that which is missed least."""
    problem, count = found.problem, len(found.best.space.hypotheses)
    if count == 1:
        return found.bare()
    indices = range(count) if index is None else [index]
    best = polish(problem, min((dropped(problem, found.best, i, 10) for i in indices), key=lambda f: f.cost))
    best = enrich(problem, best, decide.better)
    return found._replace(best=best, rivals=replacements(problem, best, found.search, (), quiet))


def proposed(sim: Simulator, seen_by: Fit) -> list[Hypothesis]:
    """All hypotheses, with the starts that the record suggests once it is seen through a model."""
    model = seen_by.model
    return hypotheses(sim.record, model.base, hints(sim, model), beside=model.terms)


def replacements(
    problem: Problem, best: Fit, looked: Search, candidates: Sequence[Hypothesis], progress: Progress
) -> Places:
    """For each hypothesis of the best model, fits with another one in its place, nearest first.

    They are those that the search has fitted, the same law by another name if it has one, and, where there are
    `candidates`, the most likely of these.
    """
    out = []
    for index, h in enumerate(best.space.hypotheses):
        rest = set(names(best)) - {h.name}
        tried = [f for f in looked.fits if len(f.space.hypotheses) == len(rest) + 1 and rest < set(names(f))]
        if candidates and decide.enough(problem, looked.base, best):  # else nothing is named
            progress(f"look-alikes of {h.name}")
            alike = set(TERMS[h.term].look_alikes)
            if rest:
                tried += rivals(problem, best, index, candidates, alike)
            else:
                alike -= {f.space.hypotheses[0].term for f in tried}
                tried += look_alikes(problem, looked.base, looked.scores, alike, best.cost)
        other = renamed(best.model.kind, h, best.space.parts(best.x)[index])
        if other is not None:
            tried.append(fit(problem, exchanged(best, index, other), best.x, rounds=2, J=best.J))
        nearest: dict[tuple[str, ...], Fit] = {}
        for f in sorted(tried, key=lambda f: f.merit):
            if names(f) != names(best):
                nearest.setdefault(names(f), f)
        fits = parallel([partial(deepened, problem, f, best, index) for f in list(nearest.values())[:MOST]])
        places = [Alternative(f, _other(f, rest)) for f in sorted(fits, key=lambda f: f.merit)]
        out.append(tuple(places))
    return tuple(out)


def deepened(problem: Problem, rival: Fit, best: Fit, index: int) -> Fit:
    """To the bottom where it is near the best, in whose place `index` it has another term, and in a richer form where
    the best has one there. It is as well tried with all else as in the best: its own fit may have ended in a trough."""
    own = best.space.hypotheses[index]
    if is_rich(own) and rival.cost < RICH * best.cost:
        rival = enrich(problem, rival, decide.better)
    if best.cost < rival.cost < RICH * best.cost:
        other = _other(rival, set(names(best)) - {own.name})
        h, x = rival.space.hypotheses[other], rival.space.parts(rival.x)[other]
        if rms(placed(problem, best, index, h, x)) < rival.rms:
            rival = min(rival, with_other(problem, best, index, h, x, 10), key=lambda f: f.cost)
    return polish(problem, rival) if rival.cost < NEAR * best.cost else rival


def _other(fitted: Fit, rest: set[str]) -> int:
    """Index of the hypothesis that is not among the rest."""
    return next(i for i, h in enumerate(fitted.space.hypotheses) if h.name not in rest)
