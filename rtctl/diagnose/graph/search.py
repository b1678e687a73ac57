"""Search: combinations of up to three effects, each refitted under a noise of its own, by evidence.

Source: beam search over forward steps, with removal and exchange of each effect at the end.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.graph.enrich import enriched, restarted
from rtctl.diagnose.graph.fits import INEXACT, Fitted, exactness, explained, refit, relaxed, solid, without
from rtctl.diagnose.graph.hypotheses import combined, hypotheses
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.graph.screen import Score, Screened, screen
from rtctl.diagnose.space import Space

MOST = 3  # effects
REBASED = 3  # rounds of the base and of the first effect; models with one effect from which the base is fitted again
MORE = 1.0  # nats that this must bring
NAMES = (8, 5, 4)  # terms that are refitted in each step, and in the exchange 4
STARTS = 2  # of the first few of them
FIRST = 3
OTHERS = 3  # nodes of the best terms beside the first
LEAST = 6.0  # nats that screening must promise for a refit
BEAM = 2
ENOUGH = 5.0  # nats of evidence that a first effect must bring
WORTH = 3.0  # nats that a further one must bring
PART = 0.3  # share of the power that the others leave, which a further effect must take off
FAR = 30.0  # nats behind the best at which a combination is dropped

Progress = Callable[[str], None]


class Found(NamedTuple):
    """All that was fitted."""

    like: Likelihood
    base: Fitted
    scores: tuple[Score, ...]  # beside the base
    fits: tuple[Fitted, ...]  # best first, the base among them
    odds: float  # ln of the prior odds of one effect at one place

    def merit(self, f: Fitted) -> float:
        """Logarithm of the posterior, up to a constant."""
        return merit_of(f, self.odds)

    @property
    def best(self) -> Fitted:
        """The combination with the highest posterior."""
        return self.fits[0]


def search(like: Likelihood, space: Space, progress: Progress = lambda _: None) -> Found:
    """Fit the base, then what is missing beside it."""
    progress("fitting the nominal parameters")
    base = restarted(refit(like, space))
    for _ in range(REBASED):
        progress("screening every hypothesis")
        looked, odds = screened(base)
        known: dict[tuple[str, ...], Fitted] = {(): base}
        progress("fitting effect 1")
        grown = step(like, base, looked, known, NAMES[0])
        again = rebased(base, grown)
        if again is base:
            break
        base = again
    share = exactness(base, min((base, *grown), key=lambda f: f.loss))
    like = like.trusted(share)
    known = {names: f._replace(like=f.like.trusted(share)) for names, f in known.items()}
    base, grown = known[()], [known[key(f.names)] for f in grown]
    merit = partial(merit_of, odds=odds)
    beam = [base]
    for level in range(MOST):
        if level > 0:
            grown = []
            for parent in beam:
                progress(f"fitting effect {level + 1} beside {', '.join(parent.names)}")
                grown += step(like, parent, screened(parent)[0], known, NAMES[level])
        better = [f for f in grown if adds(base, _parent(f, beam), f, merit)]
        if not better:
            break
        better.sort(key=merit, reverse=True)
        beam = [f for f in better if merit(f) > merit(better[0]) - FAR][:BEAM]
        beam[0] = known[key(beam[0].names)] = restarted(enriched(beam[0]))
    progress("exchanging each effect")
    best = max((f for f in known.values() if stands(base, f, known, merit)), key=merit)
    for index in range(len(best.names) if len(best.names) > 1 else 0):
        rest = refit(like, *without(best, index))
        known.setdefault(key(rest.names), rest)
        step(like, rest, screened(rest)[0], known, NAMES[-1])
    progress("asking for other forms of what was found")
    best = max((f for f in known.values() if stands(base, f, known, merit)), key=merit)
    if best.names:
        known[key(best.names)] = enriched(best)
    standing = [f for f in known.values() if stands(base, f, known, merit)]
    return Found(like, base, tuple(looked.scores), tuple(sorted(standing, key=merit, reverse=True)), odds)


def rebased(base: Fitted, grown: Sequence[Fitted]) -> Fitted:
    """The base from where the best models with one effect have its parameters, if that is better by what counts.

    Where the likelihood has many maxima, an effect may only have shown the way to a better one of the base.
    """
    for f in sorted(grown, key=lambda f: f.loss)[:REBASED]:
        if f.loss < base.loss - ENOUGH:
            again = refit(base.like, *without(f, 0))
            if again.log_evidence > base.log_evidence + MORE:
                base = again
    return base


def merit_of(f: Fitted, odds: float) -> float:
    """Logarithm of the posterior of a combination, up to a constant; `odds` are those of one effect at one place."""
    return f.log_evidence - odds * len(f.space.hypotheses) - f.seldom


def adds(base: Fitted, fewer: Fitted, more: Fitted, merit: Callable[[Fitted], float]) -> bool:
    """Whether a further effect is worth its numbers, and more than what the laws of the others may be wrong by."""
    if merit(more) < merit(fewer) + WORTH:
        return False
    return not fewer.names or (explained(fewer, more) > PART and amplitude(base.e, fewer.e, more.e) > INEXACT)


def amplitude(base: np.ndarray, fewer: np.ndarray, more: np.ndarray) -> float:
    """What a further effect takes off the residual (blocks, sensors) over what all take off, rms, of the sensor that
    shows most of it."""
    further = np.sqrt(np.mean((fewer - more) ** 2, axis=0))
    whole = np.sqrt(np.mean((base - more) ** 2, axis=0))
    return float(np.max(further / np.maximum(whole, 1e-300)))


def stands(base: Fitted, f: Fitted, known: dict[tuple[str, ...], Fitted], merit: Callable[[Fitted], float]) -> bool:
    """Whether every effect of a combination has a size, and adds to the combination without it, as far as that was
    fitted."""
    if not f.names:
        return True
    if not solid(f):
        return False
    if len(f.names) == 1:
        return merit(f) > merit(base) + ENOUGH
    rest = (key(set(f.names) - {name}) for name in f.names)
    return all(adds(base, known[names], f, merit) for names in rest if names in known)


def screened(parent: Fitted) -> tuple[Screened, float]:
    """Scores beside a model, and the prior odds of one of them."""
    sim = parent.like.sim
    model = parent.model
    candidates = [
        h for h in hypotheses(sim, model, combined(parent.like, model), model.terms) if h.name not in parent.names
    ]
    names = {h.name for h in candidates}
    return screen(parent, candidates), float(np.log(max(len(names), 1)))


def step(
    like: Likelihood, parent: Fitted, looked: Screened, known: dict[tuple[str, ...], Fitted], most: int
) -> list[Fitted]:
    """Refits of a model with each of the most promising hypotheses beside it.

    Each term is tried at its most promising node, then the best terms at their other nodes.
    """
    top: dict[str, dict[str, list[Score]]] = {}
    for score in looked.promising(most):
        if max(score.gain, score.power) > LEAST and (len(top) < most or score.hypothesis.term in top):
            top.setdefault(score.hypothesis.term, {}).setdefault(score.hypothesis.name, []).append(score)

    def refitted(scores: list[Score], starts: int) -> Fitted:
        names = key((*parent.names, scores[0].hypothesis.name))
        if names not in known:
            fits = [
                refit(like, parent.space.add(s.hypothesis), x, parent.J, looked.floor, relax=False)
                for s in scores[:starts]
                for x in looked.starts(s, starts)
            ]
            known[names] = max(fits, key=lambda f: f.log_evidence)
        return known[names]

    firsts = {
        term: refitted(next(iter(nodes.values())), STARTS if rank < FIRST else 1)
        for rank, (term, nodes) in enumerate(top.items())
    }
    out = list(firsts.values())
    for term in sorted(firsts, key=lambda term: -firsts[term].log_evidence)[:BEAM]:
        out += [refitted(scores, 1) for scores in list(top[term].values())[1 : 1 + OTHERS]]
    for f in sorted(out, key=lambda f: -f.log_evidence)[:FIRST]:
        known[key(f.names)] = relaxed(f)
    return [known[key(f.names)] for f in out]


def key(names: Iterable[str]) -> tuple[str, ...]:
    """The names of a combination, in alphabetical order."""
    return tuple(sorted(names))


def _parent(f: Fitted, beam: list[Fitted]) -> Fitted:
    inside = [p for p in beam if set(p.names) <= set(f.names)]
    return max(inside, key=lambda p: p.log_evidence)
