"""Verdict from the posterior of all rivals: named from a probability of 0.9, else ambiguous, unnamed or nothing."""

from typing import NamedTuple

from rtctl.diagnose.calibration import MOSTLY, POOR, SURE, VISIBLE
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED
from rtctl.diagnose.evidence.evidence import Rival, rivals
from rtctl.diagnose.evidence.free import Free
from rtctl.diagnose.likelihood.clock import Clock, clock
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import explained, poor, shown
from rtctl.diagnose.search.search import Found

ALIKE = 3  # names of an ambiguous answer


class Verdict(NamedTuple):
    """Verdict on a recording."""

    verdict: str
    best: Fitted  # the accepted model: the base where nothing is named
    confidence: tuple[float, ...]  # of each effect of the best
    rivals: tuple[tuple[tuple[str, float], ...], ...]  # of each effect: term:node in its place, probability
    probabilities: tuple[tuple[tuple[str, ...], float], ...]  # of combinations, best first
    unlisted: Free | None  # the likeliest unnamed force or error of a reading
    beside: Fitted  # the model beside which `unlisted` was fitted
    why: str  # one sentence
    table: tuple[Rival, ...]  # all rivals, the most probable first
    ticks: Clock | None = None  # jitter of the ticks, where it is significant


def verdict(found: Found) -> Verdict:
    """Verdict of a search, and on the jitter of the ticks, which the residual of the best model shows."""
    decided = of_motion(found)
    ticks = clock(decided.best)
    if ticks.probability < SURE:
        return decided
    kind = NAMED if decided.verdict == NOTHING else decided.verdict
    return decided._replace(verdict=kind, ticks=ticks)


def of_motion(found: Found) -> Verdict:
    """Verdict on the motion of the machine, without the jitter of the ticks."""
    table = rivals(found)
    ranked = combinations(table)
    nothing, unlisted = dict(ranked).get((), 0.0), 1.0 - sum(p for _, p in ranked)
    fits: dict[tuple[str, ...], Fitted] = {}
    for rival in (r for r in table if not r.unlisted):
        fits.setdefault(rival.fit.names, rival.fit)
    top = nameless_best(table)
    free, beside = (None, found.base) if top is None else (None if top.doubted else top.free, top.fit)
    best = fits[certain(ranked)]

    left = poor(found.base)

    def answer(kind: str, model: Fitted, why: str) -> Verdict:
        if kind == NOTHING and left > POOR:  # the most probable explanation may leave a large residual
            kind, why = UNNAMED, f"the description leaves a residual of {100 * left:.0f} % of a sensor's signal; {why}"
        return Verdict(kind, model, (), (), ranked, free, beside, why, table)

    if nothing > 1.0 - SURE and nothing > unlisted:
        return answer(NOTHING, found.base, f"the description alone has a probability of {100 * nothing:.0f} %")
    nameless = unlisted > 0.5 or not best.names
    what = ""
    if top is not None:
        what = f"a wrong {top.doubted}" if free is None else f"{free.kind} at {free.node} by {free.axis} without a name"
        what += f" has a probability of {100 * unlisted:.0f} %"
    alone = set(robust(table, best.names)) if nameless else set()
    whole = next((f for names, f in fits.items() if alone and set(names) == alone), None)
    if whole is not None and explained(found.base, whole) >= MOSTLY:
        return of_names(answer(NAMED, whole, f"besides, {what}"))
    stands = beside if nameless else best
    if not (nameless and free) and (seen := shown(found.base, stands)) < VISIBLE:
        why = f"no model explains more than {100 * max(seen, 0.0):.0f} % of the residual or missing force beyond noise"
        return answer(NOTHING, found.base, why)
    if nameless:
        also = f"beside {', '.join(beside.names)}, " if beside.names else ""
        return answer(UNNAMED, beside, f"{also}{what}")
    share = explained(found.base, best)
    if share < MOSTLY:
        bare = max((r for r in table if not r.fit.names), key=lambda r: r.merit)
        why = f"{', '.join(best.names)} explains {100 * share:.0f} % of the residual beyond sensor noise"
        if bare.unlisted:
            return answer(UNNAMED, best, why)
        return answer(NOTHING, found.base, f"{why}, and the remaining residual agrees with sensor noise")
    return of_names(answer(NAMED, best, ""))


def combinations(table: tuple[Rival, ...]) -> tuple[tuple[tuple[str, ...], float], ...]:
    """Probability of each combination of named effects, likeliest first."""
    named: dict[tuple[str, ...], float] = {}
    for rival in table:
        if not rival.unlisted:
            named[rival.fit.names] = named.get(rival.fit.names, 0.0) + rival.probability
    return tuple(sorted(named.items(), key=lambda item: -item[1]))


def nameless_best(table: tuple[Rival, ...]) -> Rival | None:
    """Likeliest unnamed rival; None where there is none.

    Rivals are grouped by place and axis, or by wrong number. The group with the highest total probability is taken, and
    in the group the rival with the highest posterior on the whole recording.
    """
    found: dict[tuple[str, ...], list[Rival]] = {}
    for r in table:
        if r.doubted:
            found.setdefault((r.doubted,), []).append(r)
        elif r.free is not None and r.unlisted:
            found.setdefault((r.free.kind, r.free.node, r.free.axis), []).append(r)
    if not found:
        return None
    most = max(found.values(), key=lambda group: (sum(r.probability for r in group), max(r.merit for r in group)))
    return max(most, key=lambda r: r.merit)


def robust(table: tuple[Rival, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """Names that are sure both with and without a wrong nominal number: each kind of rival contains them."""
    listed = [r for r in table if not r.unlisted]
    both = [*listed, *(r for r in table if r.doubted)]
    share = sum(r.probability for r in listed)
    if share <= 1.0 - SURE:
        return ()

    def held(some: list[Rival], name: str) -> float:
        return sum(r.probability for r in some if holds(r.fit.names, name.partition(":")[0]))

    return tuple(name for name in names if held(listed, name) >= SURE * share and held(both, name) >= SURE)


def of_names(decided: Verdict) -> Verdict:
    """Verdict with the confidence and the rivals of each effect of its best model."""
    ranked, best = decided.probabilities, decided.best
    sure = [(r.fit.names, r.probability) for r in decided.table if r.doubted or not r.unlisted]
    confidence = tuple(sum(p for names, p in sure if holds(names, term)) for term in terms(best))
    others = tuple(_rivals(ranked, best.names, index) for index in range(len(best.names)))
    kind = NAMED if min(confidence) >= SURE else AMBIGUOUS
    return decided._replace(verdict=kind, confidence=confidence, rivals=others)


def fewer(decided: Verdict, best: Fitted, why: str) -> Verdict:
    """Verdict with a model of fewer effects; `why` completes the sentence "without EFFECTS, ..."."""
    if best.names == decided.best.names or decided.verdict not in (NAMED, AMBIGUOUS):
        return decided
    gone = ", ".join(name for name in decided.best.names if name not in best.names)
    return of_names(decided._replace(best=best, why=f"without {gone}, {why}"))


def certain(ranked: tuple[tuple[tuple[str, ...], float], ...]) -> tuple[str, ...]:
    """Likeliest combination, without an effect whose absence is not improbable."""
    best = next((names for names, _ in ranked if names), ())
    for name in best:
        rest = tuple(other for other in best if other != name)
        term = name.partition(":")[0]
        sure = sum(p for names, p in ranked if holds(names, term)) >= SURE
        absent = sum(p for names, p in ranked if set(names) == set(rest)) > 1.0 - SURE
        if rest and absent and not sure:
            return next(names for names, _ in ranked if set(names) == set(rest))
    return best


def terms(f: Fitted) -> list[str]:
    """Term of each hypothesis."""
    return [h.term for h in f.space.hypotheses]


def holds(names: tuple[str, ...], term: str) -> bool:
    """Whether a combination has a term, at any node."""
    return any(name.partition(":")[0] == term for name in names)


def _rivals(
    ranked: tuple[tuple[tuple[str, ...], float], ...], best: tuple[str, ...], index: int
) -> tuple[tuple[str, float], ...]:
    """Names in the place of one effect of the best, each with its probability, highest first."""
    rest = set(best) - {best[index]}
    out: dict[str, float] = {}
    for names, p in ranked:
        others = [name for name in names if name not in rest]
        if rest <= set(names) and len(others) == 1 and others[0] != best[index]:
            out[others[0]] = out.get(others[0], 0.0) + p
    return tuple(sorted(out.items(), key=lambda item: -item[1])[: 2 * ALIKE])
