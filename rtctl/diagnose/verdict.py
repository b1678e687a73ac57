"""Turns what the search found into a verdict: named, ambiguous, unnamed or nothing, each name with its confidence.

A name stands when the model with it explains what there was to explain and no other name does nearly as well in its
place, where errors of neighbouring ticks that go together count as one.
"""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnose import chances, decide, plausible
from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED, Effect, Interval, Rival
from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.hypotheses import FALLING
from rtctl.diagnose.jitter import Jitter, interval
from rtctl.diagnose.model import ADDS_DRY, DRY, dry_friction
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import dropped
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.uncertainty import covariance, effect_intervals, with_form
from rtctl.diagnose.white import White
from rtctl.plants.physics import TERMS, only

SURE = 0.9  # weight of a name among its rivals: of generated names below it, five in six were the rival's
POSSIBLE = 0.05  # weight from which a rival is mentioned
LOST = 1e3  # error of a free run that ran away, which tells nothing of the terms
TELLING = 3.0  # times the noise: a prediction that was worse than that can be made better
CLOSED, CLOSED_BY_SEVERAL = 0.6, 0.87  # of the gap to the noise, that one named term and that several must close
LEANS = 0.6  # confidence in a name that is not sure, above which it has to predict as a sure one does
RIGHT = (0.98, 0.95, 0.88)  # confidence in one, two, three names of a model that is right to the noise
EVEN, BY_SIZE = 0.1, 0.8  # chance of a rival that does as well; confidence where usual sizes tell: 9 of 12 were right
HALF = 0.5  # confidence in what a record cannot test, at most
KNOWN = 0.95  # confidence in what nothing else gives the sign of
MOST = 3  # names in an answer
BESIDE = 2  # rivals told besides
IN_WHITE = 8  # rounds of a fit to white errors
WITHOUT = 4  # rounds of a fit that only tells how much depends on a term
LATE = only("late", "bends"), only("late", "delay")  # of which the first bends to what the other is
IMITATED = 1e-4  # chance that one does no more than that


class Alternative(NamedTuple):
    """A fit in which hypothesis `at` stands in the place of one of the best model's."""

    fit: Fit
    at: int

    @property
    def hypothesis(self) -> Hypothesis:
        """The one that stands there."""
        return self.fit.space.hypotheses[self.at]


class Verdict(NamedTuple):
    verdict: str
    effects: tuple[Effect, ...]
    explained: float  # share of the excess over the noise


def judged(
    problem: Problem,
    base: Fit,
    best: Fit,
    rivals: Sequence[Sequence[Alternative]],
    block: int,
    cannot: Collection[str] = (),
) -> Verdict:
    """The verdict on `best`; `rivals` holds for each of its hypotheses the fits with another one in its place, `cannot`
    what the record cannot test, as "term:node": such a name is in doubt as soon as a rival does as well."""
    loud = decide.loud(problem, base)
    if not best.space.hypotheses:
        return Verdict(UNNAMED if loud else NOTHING, (), 0.0)
    share = decide.explained(problem, base, best)
    whole = decide.complete(problem, base, best)
    if patched(best) or plausible.absurd(best):
        return Verdict(UNNAMED, (), share)
    if not decide.enough(problem, base, best):
        longer = chances.blocks(problem, best)
        loud = loud or (share > decide.HALF and chances.p_value(best, base, longer) < decide.UNLIKELY)
        return Verdict(UNNAMED if loud else NOTHING, (), share)
    right = RIGHT[min(len(best.space.hypotheses), MOST) - 1]
    trust = right if whole else min(right, 0.6 + 0.35 * share)
    own, others = [], []
    doubt = False
    for index in by_weight(problem, best):
        places = [Alternative(best, index), *rivals[index]]
        names = shared(problem, places)
        term = places[0].hypothesis.term
        own.append(_effect(places[0], names[term] * trust, best, rivals[index], block))
        untested = places[0].hypothesis.name in cannot
        equal = {r.name for r in own[-1].look_alikes if untested and r.p_value > EVEN}
        if names[term] < SURE or equal:
            doubt = True
            for name, weight in sorted(names.items(), key=lambda item: -item[1]):
                if name != term and (weight > POSSIBLE or name in equal):
                    place = next(p for p in places if p.hypothesis.term == name)
                    rival = _effect(place, weight * trust, best, (), block)
                    others.append(rival._replace(instead_of=places[0].hypothesis.name))
    if not doubt:
        return Verdict(NAMED, tuple(own), share)
    new = [e for e in others if e.name not in {o.name for o in own}]
    return Verdict(AMBIGUOUS, listed(own, new), share)


def listed(own: Sequence[Effect], rivals: Sequence[Effect]) -> tuple[Effect, ...]:
    """What is there, and the likeliest that could stand in its place, so that a sure name beside takes no rival's."""
    return (*own, *rivals[:BESIDE])


def by_weight(problem: Problem, best: Fit) -> list[int]:
    """Numbers of the hypotheses, that first without which the model is worst."""
    count = len(best.space.hypotheses)
    if count < 2:
        return list(range(count))
    without = [dropped(problem, best, i, WITHOUT).cost for i in range(count)]
    return sorted(range(count), key=lambda i: -without[i])


def proven(verdict: Verdict, closed: float, several: bool, otherwise: str = UNNAMED) -> Verdict:
    """The verdict once its model has predicted rows that it was not fitted on, and `closed` this share of the gap to
    the noise that the model without its names leaves there. `otherwise` is the verdict where the names are not borne
    out; a share that is not a number bears out none.

    Terms that only imitate what is missing fit the rows that they have seen and predict the others badly, `several` of
    them together most of all.
    """
    if not (verdict.verdict == NAMED or leans(verdict)):
        return verdict
    if not closed >= (CLOSED_BY_SEVERAL if several else CLOSED):
        return Verdict(otherwise, (), verdict.explained)
    sure = 0.5 + 0.5 * min(closed, 1.0)
    return verdict._replace(effects=tuple(e._replace(confidence=min(e.confidence, sure)) for e in verdict.effects))


def only_testable(verdict: Verdict, cannot: Collection[str]) -> Verdict:
    """The verdict without a name that the record cannot test, as "term:node" in `cannot`: the one place that every
    verdict of a diagnosis passes last.

    An effect that cannot be tested may stand as one of several in an `ambiguous` verdict, where a rival could stand in
    its place; without one something is there, and it has no name.
    """
    untested = {label(e) for e in verdict.effects if e.instead_of is None and label(e) in cannot}
    rivalled = {e.instead_of for e in verdict.effects}
    if not untested:
        return verdict
    if verdict.verdict != AMBIGUOUS or not untested <= rivalled:
        return Verdict(UNNAMED, (), verdict.explained)
    effects = (e._replace(confidence=min(e.confidence, HALF)) if label(e) in cannot else e for e in verdict.effects)
    return verdict._replace(effects=tuple(effects))


def label(effect: Effect) -> str:
    """As in `cannot_test`: term:node."""
    return f"{effect.name}:{effect.node}"


def leans(verdict: Verdict) -> bool:
    """Whether an `ambiguous` verdict holds each of its names for the likelier one by far."""
    own = [e.confidence for e in verdict.effects if e.instead_of is None]
    return verdict.verdict == AMBIGUOUS and min(own, default=0.0) > LEANS


def patched(best: Fit) -> bool:
    """Whether frictions that take from each other imitate a curve over speed that the library has not.

    Less of one kind and more of another is no machine's doing, nor less dry friction at one body and more at another;
    nor is friction that falls with speed to dry friction of which the owner's tolerance leaves no less, or that does
    not fall but rises.
    """
    model = best.model
    found = [(h, h.values(x)) for h, x in zip(best.space.hypotheses, best.space.parts(best.x), strict=True)]
    for h, values in found:
        if h.term == FALLING and (
            lowest(best, DRY[model.kind].get(h.node, ""))
            or values["F_s"] < dry_friction(model.kind, model.base, h.node)
        ):
            return True
    dry = [values["F_C"] for h, values in found if h.term == ADDS_DRY]
    more = max(dry, default=0.0) > 0.0 or any(TERMS[h.term].makes_up for h, _ in found)
    return more and min(dry, default=0.0) < 0.0


def lowest(fitted: Fit, name: str) -> bool:
    """Whether a plant parameter is as low as the owner's tolerance lets it be."""
    return name in fitted.bound() and float(fitted.x[fitted.space.names.index(name)]) < 0.0


def with_known(verdict: Verdict, known: Sequence[Effect]) -> Verdict:
    """The verdict with effects before it that show elsewhere than in the error of the fit, and stand for themselves."""
    if not known or verdict.verdict == UNNAMED:
        return verdict
    effects = [*(e for e in known if e.name not in {v.name for v in verdict.effects}), *verdict.effects]
    named = NAMED if verdict.verdict == NOTHING else verdict.verdict
    return verdict._replace(verdict=named, effects=tuple(effects[:MOST] if named == NAMED else effects))


def of_jitter(found: Jitter) -> Effect:
    """Of the ticks, which shows in the noise."""
    low, high = interval(found)
    return Effect(only("clock"), "loop", KNOWN, {"sigma": Interval(found.sigma, low, high, "s")}, ())


def standing(problem: Problem, best: Fit, index: int, rivals: Sequence[Alternative]) -> float:
    """Weight of the name of one hypothesis of the best model among those that could stand in its place."""
    places = [Alternative(best, index), *rivals]
    return shared(problem, places)[places[0].hypothesis.term]


def shared(problem: Problem, places: Sequence[Alternative]) -> dict[str, float]:
    """Weight of each name among `places`, that of the best model first."""
    return weigh(places, weights(problem, places))


def weights(problem: Problem, places: Sequence[Alternative]) -> np.ndarray:
    """Weight of each of the places. A lag and a delay share theirs by what they do to white errors.

    Where more than noise is left, a lag that is as good as the delay that it could imitate has as much as that: the lag
    has more to bend, and what little a delay leaves, of a driver's own lag or a fraction of a tick, it follows.
    """
    fits = [p.fit for p in places]
    if problem.white is not None:
        return decide.probabilities(in_white(problem.white, fits))
    out = decide.probabilities(fits, problem.floor)
    late = [next((i for i, p in enumerate(places) if p.hypothesis.term == term), -1) for term in LATE]
    if min(late) < 0:
        return out
    pair = [fits[i] for i in late]
    best = min(pair, key=lambda f: f.cost)
    if best.rms < decide.COMPLETE * problem.floor:
        shares = decide.probabilities(in_white(White(problem, best.r), pair))
    elif late[0] == 0 and chances.p_value(fits[0], fits[late[1]], problem.block) > IMITATED:
        shares = np.array([0.5, 0.5])
    else:
        return out
    of_either = np.array([p.hypothesis.term in LATE for p in places])
    both = float(out[of_either].sum())
    out[of_either] = 0.0
    out[late] = shares * both
    return out


def in_white(white: White, fits: Sequence[Fit]) -> list[Fit]:
    """The models fitted to white errors."""
    return [fit(white, f.space, f.x, rounds=IN_WHITE, J=white.through(f.J)) for f in fits]


def weigh(places: Sequence[Alternative], weights: np.ndarray) -> dict[str, float]:
    """Weight of each name: nodes and starts of one term count together."""
    out: dict[str, float] = {}
    for place, weight in zip(places, weights, strict=True):
        out[place.hypothesis.term] = out.get(place.hypothesis.term, 0.0) + float(weight)
    return out


def _effect(place: Alternative, weight: float, best: Fit, rivals: Sequence[Alternative], block: int) -> Effect:
    h = place.hypothesis
    looks = tuple(
        Rival(r.hypothesis.term, r.hypothesis.node, chances.p_value(best, r.fit, block), r.fit.rms)
        for r in rivals
        if r.hypothesis.term != h.term
    )
    intervals = effect_intervals(place.fit, place.at, with_form(place.fit, covariance(place.fit, block)))
    return Effect(h.term, h.node, confidence(weight, looks), intervals, looks)


def confidence(weight: float, looks: Sequence[Rival]) -> float:
    """In a name of this weight: where a rival does as well, no more than what sizes are usual may give."""
    return min(weight, BY_SIZE if any(r.p_value > EVEN for r in looks) else 0.99)
