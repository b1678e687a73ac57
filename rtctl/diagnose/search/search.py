"""Search: combinations of a few effects, each refitted under a noise of its own, by evidence.

Source: beam search over forward steps, with removal and exchange of each effect at the end.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.likelihood.bandwidth import STEP, quicker
from rtctl.diagnose.likelihood.descent import ALL
from rtctl.diagnose.likelihood.fits import Fitted, finished, refit
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.shares import silent
from rtctl.diagnose.likelihood.widths import faint
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.search.begin import Begun, Progress, begun
from rtctl.diagnose.search.enrich import enriched, restarted
from rtctl.diagnose.search.exchange import exchanged, smaller
from rtctl.diagnose.search.extend import NEAR, Known, Merit, extended, key, screened
from rtctl.diagnose.search.screen import Score
from rtctl.diagnose.search.standing import adds, merit_of, standing

MOST = 4  # effects of a model, at most
NAMES = (8, 4, 4)  # terms that are refitted as a second, a third and a fourth effect, beside any of the models
BEAM = (4, 3, 2)  # models that are extended by a second, a third and a fourth effect
ALIKE = 0.995  # cosine from which two models make the same change of the residual
EXCHANGES = 2  # rounds of exchange, at most
RIVALS, CLOSE = 3, 5.0  # models whose other forms are fitted, at most, and nats behind the best model, at most


class Found(NamedTuple):
    """Result of a search: the fitted models."""

    like: Likelihood
    base: Fitted
    scores: tuple[Score, ...]  # beside the base
    fits: tuple[Fitted, ...]  # best first, the base among them
    odds: float  # ln of the prior odds of one effect at one place
    doubts: tuple[Fitted, ...] = ()  # models with a gross error in one number of the description

    def merit(self, f: Fitted) -> float:
        """Logarithm of the posterior of a model, nats, up to a constant."""
        return merit_of(f, self.odds)

    @property
    def best(self) -> Fitted:
        """The combination with the highest posterior."""
        return self.fits[0]


def search(like: Likelihood, space: Space, progress: Progress = lambda _: None) -> Found:
    """Fitted models of a recording: base and combinations of effects, under the bandwidth of the best model.

    The best model with one effect at most decides the bandwidth of the observer. Where the best of all models decides
    for another bandwidth, the search is repeated.
    """
    usual = begun(like, space, progress)
    progress("choosing the bandwidth of the observer")
    times, before = quicker(usual.order[0]), usual.order[:RIVALS]
    times = times if times > STEP else 1.0  # a second effect often explains a gain of one step
    found = under(usual if times == 1.0 else begun(like.following(times), space, progress), progress, before)
    progress("choosing the bandwidth of the observer")
    best = found.best
    again = quicker(best if times == 1.0 else refit(like, best.space, best.x))
    if again == times or (min(again, times) > 1.0 and max(again / times, times / again) <= STEP):
        return found
    begin = usual if again == 1.0 else begun(like.following(again), space, progress)
    return under(begin, progress, found.fits[:RIVALS])


def under(begin: Begun, progress: Progress, before: Sequence[Fitted] = ()) -> Found:
    """Fitted models of a recording under one bandwidth; the models `before`, of another bandwidth, are rivals too."""
    base, grown, looked, odds = begin
    like = base.like  # with the times of the ticks
    merit = partial(merit_of, odds=odds)
    known: Known = {key(f.names): f for f in (base, *grown)}
    parents, asked = [base], set[tuple[str, ...]]()
    for level in range(1, MOST + 1):
        better = [f for f in grown if adds(base, _parent(f, parents), f, merit)]
        if not better:
            break
        better = enriched_near(better, known, merit, asked)
        better[0] = known[key(better[0].names)] = restarted(better[0])
        for rest in smaller(like, better[0], known, faint(better[0])):
            known[key(rest.names)] = rest
        if level == MOST:
            break
        most = 1 if silent(better[0]) else BEAM[level - 1]  # no rival explains more than noise
        parents = [finished_in(known, f) for f in apart(base, better, most)]
        progress(f"fitting effect {level + 1} beside {'; '.join(', '.join(f.names) for f in parents)}")
        looks = [screened(parent) for parent in parents]
        grown = extended(like, parents, known, NAMES[level - 1], merit, looks)
        if not any(adds(base, _parent(f, parents), f, merit) for f in grown):
            progress(f"trying other names for effect {level + 1}")
            grown += extended(like, parents, known, NAMES[level - 1], merit, looks, passed=[f.names for f in grown])
    for f in (f for f in before if key(f.names) not in known):
        known[key(f.names)] = again = refit(like, f.space, f.x)
        known |= {key(g.names): g for g in smaller(like, again, known)}
    for _ in range(EXCHANGES):
        best = leading(base, known, merit)[0]
        progress(f"trying a replacement for each of {', '.join(best.names)}")
        exchanged(like, base, best, known, looked, merit)
        if leading(base, known, merit)[0] is best:
            break
    progress("trying other forms of the effects")
    enriched_near([f for f in leading(base, known, merit) if f.names], known, merit, asked)
    return Found(like, base, tuple(looked.scores), tuple(leading(base, known, merit)), odds)


def leading(base: Fitted, known: Known, merit: Merit) -> list[Fitted]:
    """Accepted models, by posterior; drafts within NEAR of the best are fitted to convergence first."""
    while True:
        order = standing(base, known, merit)
        drafts = [f for f in order if f.fresh != ALL and merit(f) > merit(order[0]) - NEAR]
        if not drafts:
            return order
        for f in drafts:
            finished_in(known, f)


def finished_in(known: Known, f: Fitted) -> Fitted:
    """Known model, fitted to convergence and stored in `known`."""
    known[key(f.names)] = f = finished(f)
    return f


def enriched_near(fits: Sequence[Fitted], known: Known, merit: Merit, asked: set[tuple[str, ...]]) -> list[Fitted]:
    """Models, best first; the best and those near it have the forms with the highest evidence.

    A rival in its plain form is no fair comparison.
    """
    order = sorted(fits, key=merit, reverse=True)
    for f in order[:RIVALS]:
        if merit(f) > merit(order[0]) - CLOSE and key(f.names) not in asked:
            known[key(f.names)] = enriched(f)
            asked.add(key(f.names))
    return sorted((known[key(f.names)] for f in order), key=merit, reverse=True)


def apart(base: Fitted, fits: Sequence[Fitted], most: int) -> list[Fitted]:
    """The first `most` models with different terms and different changes of the residual."""
    out: list[Fitted] = []
    for f in fits:
        terms = {h.term for h in f.space.hypotheses}
        if len(out) < most and all(
            terms != {h.term for h in g.space.hypotheses} and likeness(base, f, g) < ALIKE for g in out
        ):
            out.append(f)
    return out


def likeness(base: Fitted, one: Fitted, other: Fitted) -> float:
    """Cosine of the angle between the changes of the residual by two models, each sensor over its least noise."""
    a, b = ((base.e - f.e) / base.like.least for f in (one, other))
    return float(np.sum(a * b) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))


def _parent(f: Fitted, beam: list[Fitted]) -> Fitted:
    inside = [p for p in beam if set(p.names) <= set(f.names)]
    return max(inside, key=lambda p: p.log_evidence)
