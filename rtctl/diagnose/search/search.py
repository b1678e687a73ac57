"""Search: combinations of a few effects, each refitted under a noise of its own, by evidence.

Source: beam search over forward steps, with removal and exchange of each effect at the end.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.likelihood.bandwidth import quicker
from rtctl.diagnose.likelihood.clock import clock, timed
from rtctl.diagnose.likelihood.fits import Fitted, refit, without
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.shares import silent
from rtctl.diagnose.likelihood.widths import faint
from rtctl.diagnose.model.space import Space
from rtctl.diagnose.search.enrich import enriched, restarted
from rtctl.diagnose.search.extend import Known, Merit, extended, key, screened
from rtctl.diagnose.search.screen import Score, Screened
from rtctl.diagnose.search.standing import ENOUGH, adds, merit_of, standing
from rtctl.plants.physics import TERMS

MOST = 4  # effects
REBASED = 3  # rounds of the base and of the first effect; models with one effect from which the base is fitted again
MORE = 1.0  # nats that this must bring
NAMES = (8, 8, 8, 8)  # terms that are refitted in each step, beside one model or another
OTHERS = 3  # of them beside what is left in an exchange
BEAM = 4  # models that are extended
ALIKE = 0.995  # cosine from which two models do the same
EXCHANGES = 2
RIVALS, NEAR = 3, 5.0  # models that are asked for other forms, and nats by which the best may be ahead of them

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
    """Fit the base, then what is missing beside it, under the observer that suits the best model."""
    found = under(like, space, progress)
    progress("telling how quickly the observer follows")
    times = quicker(found.best)
    return under(like.following(times), space, progress, found.fits[:RIVALS]) if times > 1.0 else found


def under(like: Likelihood, space: Space, progress: Progress, before: Sequence[Fitted] = ()) -> Found:
    """The same under one observer; the best models under the one `before` are rivals here as well."""
    base, grown, looked, odds = begun(like, space, progress)
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
        for rest in _smaller(like, better[0], known, faint(better[0])):
            known.setdefault(key(rest.names), rest)
        if level == MOST:
            break
        parents = apart(base, better)[: 1 if silent(better[0]) else BEAM]  # of noise alone no rival explains more
        progress(f"fitting effect {level + 1} beside {'; '.join(', '.join(f.names) for f in parents)}")
        grown = extended(like, parents, known, NAMES[level], merit)
    for f in (f for f in before if key(f.names) not in known):
        known[key(f.names)] = again = refit(like, f.space, f.x)
        known |= {key(g.names): g for g in _smaller(like, again, known)}
    for _ in range(EXCHANGES):
        best = standing(base, known, merit)[0]
        progress(f"exchanging each of {', '.join(best.names)}")
        alone = len(best.names) == 1  # beside the base all others have been asked for
        for index, rest in enumerate([base] if alone else _smaller(like, best, known)):
            known.setdefault(key(rest.names), rest)
            alike = TERMS[best.space.hypotheses[index].term].look_alikes
            others = extended(like, [rest], known, 0 if alone else OTHERS, merit, looked if alone else None, alike)
            for f in others:
                if merit(f) > merit(best):  # whether it needs all of its effects is asked before it stands
                    known |= {key(g.names): g for g in _smaller(like, f, known)}
        if standing(base, known, merit)[0] is best:
            break
    progress("asking for other forms of what was found")
    enriched_near([f for f in standing(base, known, merit) if f.names], known, merit, asked)
    return Found(like, base, tuple(looked.scores), tuple(standing(base, known, merit)), odds)


def begun(like: Likelihood, space: Space, progress: Progress) -> tuple[Fitted, list[Fitted], Screened, float]:
    """The base, models with one effect, what screening said of them, and the prior odds of one of them."""
    progress("fitting the nominal parameters")
    base = restarted(refit(like, space))
    told = clock(base, 0.0)
    if told.gain > 0.0:
        progress("telling the times of the ticks")
        held = refit(timed(base, told), space, base.x)
        if held.log_evidence > base.log_evidence + MORE:
            like, base = held.like, held
    for _ in range(REBASED):
        progress("screening every hypothesis")
        looked = screened(base)
        odds = float(np.log(max(len({score.hypothesis.name for score in looked.scores}), 1)))
        progress("fitting effect 1")
        grown = extended(like, [base], {(): base}, NAMES[0], partial(merit_of, odds=odds), looked)
        again = rebased(base, grown)
        if again is base:
            break
        base = again
    return base, grown, looked, odds


def enriched_near(fits: Sequence[Fitted], known: Known, merit: Merit, asked: set[tuple[str, ...]]) -> list[Fitted]:
    """Models, best first, of which the best and those near it are in the forms that the recording asks for: a rival in
    its plain form is no rival."""
    order = sorted(fits, key=merit, reverse=True)
    for f in order[:RIVALS]:
        if merit(f) > merit(order[0]) - NEAR and key(f.names) not in asked:
            known[key(f.names)] = enriched(f)
            asked.add(key(f.names))
    return sorted((known[key(f.names)] for f in order), key=merit, reverse=True)


def apart(base: Fitted, fits: Sequence[Fitted]) -> list[Fitted]:
    """The first few models of which each has other terms than those before, and changes the residual in another way."""
    out: list[Fitted] = []
    for f in fits:
        terms = {h.term for h in f.space.hypotheses}
        if len(out) < BEAM and all(
            terms != {h.term for h in g.space.hypotheses} and likeness(base, f, g) < ALIKE for g in out
        ):
            out.append(f)
    return out


def likeness(base: Fitted, one: Fitted, other: Fitted) -> float:
    """Cosine of the angle between what two models take off the residual, each sensor by its least noise."""
    a, b = ((base.e - f.e) / base.like.least for f in (one, other))
    return float(np.sum(a * b) / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))


def _smaller(like: Likelihood, f: Fitted, known: Known, which: Sequence[int] | None = None) -> list[Fitted]:
    """The model without each of its effects, or without some of them, of several."""
    out = []
    for index, name in enumerate(f.names if len(f.names) > 1 else ()):
        if which is None or index in which:
            rest = known.get(key(set(f.names) - {name}))
            out.append(rest if rest is not None else refit(like, *without(f, index)))
    return out


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


def _parent(f: Fitted, beam: list[Fitted]) -> Fitted:
    inside = [p for p in beam if set(p.names) <= set(f.names)]
    return max(inside, key=lambda p: p.log_evidence)
