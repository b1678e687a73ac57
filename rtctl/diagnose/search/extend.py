"""Extension of models by one further effect: the most promising extensions of all models together are fitted.

The order of the effects does not matter: a model with a lower posterior is extended where the pair promises more.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import FURTHER
from rtctl.diagnose.likelihood.fits import Fitted, finished, refit, relaxed
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.solver import parallel
from rtctl.diagnose.search.hypotheses import hypotheses
from rtctl.diagnose.search.screen import Score, Screened, screen
from rtctl.diagnose.search.suggestions import combined

STARTS = 2  # starts of a fit, for each of the LEADING terms
ALSO = 4  # starts of a fit, for the names `also`: screening estimates their sizes poorly
LEADING = 3  # rank by screening: terms that have several starts
SETTLED = 3  # rank by posterior: drafts that are always fitted to convergence
OTHERS = 3  # further nodes of each of the best terms
BEST = 2  # terms that are tried at their other nodes
LEAST = 6.0  # nats: least gain by screening for a refit
NEAR = 10.0  # nats behind the best model; 3 of 4 drafts gain less by convergence in 2 cases of 3 (seed 26457513)

Known = dict[tuple[str, ...], Fitted]  # by the names of the effects in alphabetical order
Merit = Callable[[Fitted], float]  # logarithm of the posterior of a model


class Promise(NamedTuple):
    """Extension of a model by one effect, with its screening score."""

    parent: Fitted
    looked: Screened
    score: Score
    gain: float  # logarithm of the posterior of the extended model, nats, by screening
    power: float  # logarithm of the likelihood of the extended model, nats, by least squares

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects of the extended model, in alphabetical order."""
        return key((*self.parent.names, self.score.hypothesis.name))

    @property
    def term(self) -> tuple[int, str]:
        """Identity of the model that is extended, and the term at any node."""
        return id(self.parent), self.score.hypothesis.term


def extended(
    like: Likelihood,
    parents: Sequence[Fitted],
    known: Known,
    most: int,
    merit: Merit,
    looks: Sequence[Screened] | None = None,
    also: Collection[str] = (),
    passed: Collection[tuple[str, ...]] = (),
) -> list[Fitted]:
    """Models with one further effect, refitted for the most promising hypotheses.

    Each term is tried at its most promising node, then the best terms at their other nodes. `known` receives all fits.
    `looks` holds the screening scores beside each model. The names `also` (term:node) are tried at any score, and their
    terms at the most promising node. With `passed` models, only other combinations of terms are tried, and only those
    that promise a gain of FURTHER.
    """
    gone = {terms_of(names) for names in passed}
    told = {name.partition(":")[0] for name in also}
    looks = [screened(parent) for parent in parents] if looks is None else looks
    found = [promise for pair in zip(parents, looks, strict=True) for promise in promises(*pair, merit)]
    top: dict[tuple[int, str], dict[tuple[str, ...], list[Promise]]] = {}
    for promise in in_turns(found):
        if gone and (terms_of(promise.names) in gone or promise.gain < merit(promise.parent) + FURTHER):
            continue
        worth = max(promise.score.gain, promise.score.power) > LEAST and (len(top) < most or promise.term in top)
        if worth or promise.term[1] in told:
            top.setdefault(promise.term, {}).setdefault(promise.names, []).append(promise)

    def refitted(wanted: Sequence[tuple[list[Promise], int]]) -> list[tuple[str, ...]]:
        """Names of the requested drafts; unknown drafts are fitted first, each from a number of starts."""
        jobs: dict[tuple[str, ...], Callable[[], Fitted]] = {}
        for these, starts in wanted:
            if these[0].names not in known:
                jobs.setdefault(these[0].names, partial(_drafted, like, these[:starts], starts))
        known.update(zip(jobs, parallel(list(jobs.values())), strict=True))
        return [these[0].names for these, _ in wanted]

    wanted = [
        (these, ALSO) for nodes in top.values() for these in nodes.values() if these[0].score.hypothesis.name in also
    ]
    first = refitted(
        [(next(iter(nodes.values())), STARTS if rank < LEADING else 1) for rank, nodes in enumerate(top.values())]
    )
    settle(known, first, merit)
    ranked = sorted(zip(top, first, strict=True), key=lambda pair: -merit(known[pair[1]]))[:BEST]
    others = refitted([(these, 1) for term, _ in ranked for these in list(top[term].values())[1 : 1 + OTHERS]])
    out = list(dict.fromkeys((*first, *refitted(wanted), *others)))
    settle(known, out, merit)
    highest = max((merit(known[names]) for names in out), default=0.0)
    for names in (names for names in out if merit(known[names]) > highest - NEAR):
        known[names] = relaxed(known[names])
    return [known[names] for names in out]


def _drafted(like: Likelihood, these: Sequence[Promise], starts: int) -> Fitted:
    """Draft with the highest evidence of an effect beside a model."""
    return max(
        (
            refit(like, one.parent.space.add(one.score.hypothesis), x, one.parent.J, one.looked.floor, draft=True)
            for one in these
            for x in one.looked.starts(one.score, starts)
        ),
        key=lambda f: f.log_evidence,
    )


def settle(known: Known, which: Iterable[tuple[str, ...]], merit: Merit) -> None:
    """Fit drafts to convergence, in order of their posterior. Stop at a draft that is behind the best model by more
    than NEAR plus the largest gain of a finished draft."""
    best, most = -np.inf, 0.0
    for rank, names in enumerate(sorted(which, key=lambda names: -merit(known[names]))):
        draft = known[names]
        if rank >= SETTLED and merit(draft) < best - most - NEAR:
            break
        known[names] = f = finished(draft)
        best, most = max(best, merit(f)), max(most, merit(f) - merit(draft))


def promises(parent: Fitted, looked: Screened, merit: Merit) -> list[Promise]:
    """Extensions of a model by each screened effect."""
    own, size = merit(parent), parent.like.size
    plain = -size * float(np.mean([np.log(noise.sigma) for noise in parent.like.flat(parent.e).noise]))
    return [
        Promise(parent, looked, score, own + parent.power * score.gain,
                plain - 0.5 * size * np.log(max(1.0 - 2.0 * score.power / size, 1e-9)))
        for score in looked.scores
    ]  # fmt: skip


def in_turns(found: Sequence[Promise]) -> list[Promise]:
    """Promises in the order of their fits: in turns by gain and by least squares."""
    orders = [sorted(found, key=lambda one: -one.gain), sorted(found, key=lambda one: -one.power)]
    return list({id(one): one for pair in zip(*orders, strict=True) for one in pair}.values())


def screened(parent: Fitted) -> Screened:
    """Screening scores of all hypotheses beside a model."""
    sim, model = parent.like.sim, parent.model
    candidates = [
        h for h in hypotheses(sim, model, combined(parent.like, model), model.terms) if h.name not in parent.names
    ]
    return screen(parent, candidates)


def terms_of(names: tuple[str, ...]) -> tuple[str, ...]:
    """Terms of a combination, in alphabetical order."""
    return tuple(sorted(name.partition(":")[0] for name in names))


def key(names: Iterable[str]) -> tuple[str, ...]:
    """Names of a combination, in alphabetical order."""
    return tuple(sorted(names))
