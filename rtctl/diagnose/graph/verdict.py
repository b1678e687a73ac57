"""Verdict from the posterior: every combination, nothing, and any force without a name compete for one probability."""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.diagnosis import AMBIGUOUS, NAMED, NOTHING, UNNAMED
from rtctl.diagnose.graph.fits import Fitted, explained
from rtctl.diagnose.graph.free import Free, free_forces
from rtctl.diagnose.graph.search import WORTH, Found

SURE = 0.9  # probability from which a name is given
FORM = 0.12  # share of what a name explains that a free force may explain beside it: no law is exact
HARDLY = 0.05  # the same, below which it is the noise that is not what it is taken for
MOSTLY = 0.7  # share of the residual's power above the noise that a name has to take off
UNLISTED = 3.0  # nats: prior odds against a force that has no name
ALIKE = 3  # names of an ambiguous answer


class Verdict(NamedTuple):
    """What the recording says."""

    verdict: str
    best: Fitted  # the model that stands: the base where nothing is named
    confidence: tuple[float, ...]  # of each effect of the best
    rivals: tuple[tuple[tuple[str, float], ...], ...]  # of each effect: term:node in its place, probability
    probabilities: tuple[tuple[tuple[str, ...], float], ...]  # of combinations, best first
    unlisted: Free | None  # the free force that explains most of what no name explains
    beside: Fitted  # the model beside which it stands
    why: str  # one sentence


def verdict(found: Found) -> Verdict:
    """Verdict of a search."""
    base, best = found.base, found.best
    free = free_forces(base)
    weights = posterior(found)
    ranked = tuple(sorted(((f.names, float(w)) for f, w in zip(found.fits, weights, strict=True)), key=lambda p: -p[1]))
    top = strongest(base, free)
    if not best.names or explained(base, best) < HARDLY:
        if top is not None and evidence(base, top) - UNLISTED > WORTH:
            return Verdict(UNNAMED, base, (), (), ranked, top, base, f"a force at {top.node} by {top.axis} has no name")
        return Verdict(NOTHING, base, (), (), ranked, top, base, "no effect is worth its numbers")
    beside = free_forces(best)
    left = strongest(best, beside)
    gained = base.loss - best.loss
    unlisted, source, why = None, base, ""
    if left is not None and evidence(best, left) - UNLISTED > WORTH and left.gain > FORM * gained:
        unlisted, source, why = (
            left,
            best,
            f"beside {', '.join(best.names)} a force at {left.node} by {left.axis} is left",
        )
    elif explained(base, best) < MOSTLY:
        unlisted, source = (left, best) if left is not None else (top, base)
        why = f"{', '.join(best.names)} takes off {100 * explained(base, best):.0f} % of what is missing"
    elif top is not None and evidence(base, top) - UNLISTED > found.merit(best) - found.merit(base):
        unlisted, why = top, f"a free force at {top.node} by {top.axis} explains more than any name"
    if why:
        return Verdict(UNNAMED, best, (), (), ranked, unlisted, source, why)
    confidence = tuple(
        float(sum(w for f, w in zip(found.fits, weights, strict=True) if holds(f, name))) for name in terms(best)
    )
    rivals = tuple(_rivals(found, weights, index) for index in range(len(best.names)))
    kind = NAMED if min(confidence) >= SURE else AMBIGUOUS
    return Verdict(kind, best, confidence, rivals, ranked, top, base, "")


def posterior(found: Found) -> np.ndarray:
    """Probability of each fitted combination."""
    merits = np.array([found.merit(f) for f in found.fits])
    w = np.exp(merits - merits.max())
    return np.asarray(w / w.sum())


def evidence(base: Fitted, free: Free) -> float:
    """Evidence that a free force adds to a model, nats."""
    return base.power * free.gain - free.volume


def strongest(base: Fitted, free: list[Free]) -> Free | None:
    """The free force with the most evidence."""
    return max(free, key=lambda f: evidence(base, f), default=None)


def terms(f: Fitted) -> list[str]:
    """Term of each hypothesis."""
    return [h.term for h in f.space.hypotheses]


def holds(f: Fitted, term: str) -> bool:
    """Whether a combination has a term, at any node."""
    return any(h.term == term for h in f.space.hypotheses)


def _rivals(found: Found, weights: np.ndarray, index: int) -> tuple[tuple[str, float], ...]:
    """Names in the place of one effect of the best, with their probability, highest first."""
    best = found.best
    own = best.names[index]
    rest = set(best.names) - {own}
    out: dict[str, float] = {}
    for f, w in zip(found.fits, weights, strict=True):
        others = [name for name in f.names if name not in rest]
        if rest <= set(f.names) and len(others) == 1 and others[0] != own:
            out[others[0]] = out.get(others[0], 0.0) + float(w)
    return tuple(sorted(out.items(), key=lambda item: -item[1])[: 2 * ALIKE])
