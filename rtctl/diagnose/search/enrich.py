"""Richer and other forms of the effects that were found: harmonics, a second branch, another shape of the same law."""

from itertools import product

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted, finished, refit, relaxed
from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.model.space import INVERSE, SIZE, Hypothesis, Space
from rtctl.diagnose.search.extend import NEAR
from rtctl.diagnose.search.grid_starts import starts_of
from rtctl.diagnose.search.term_variants import forms, is_rich
from rtctl.plants.physics import TERMS, standing

ORDER = "order"  # of a wave, per turn
ROUNDS = 2  # of other forms: a further parameter may ask for another setting beside it
WORTH = 2.0  # nats of evidence that another form must bring
QUIET = 3.0  # times the least noise, below which one maximum is enough
SHARES = (0.4, 2.5, 7.0)  # of a size, at other starts
DRAWS = 2  # starts with other nominal values


def enriched(best: Fitted) -> Fitted:
    """The model with each effect in the form that the record asks for."""
    for index in range(len(best.space.hypotheses)):
        for _ in range(ROUNDS):
            before = best
            for other in others(best, index):
                best = _better(best, index, other)
            if best is before:
                break
    return best


def _better(best: Fitted, index: int, other: Hypothesis) -> Fitted:
    """The model with one effect in another form where that is worth it, else as it is."""
    space, x = exchanged(best, index, other)
    trial = refit(best.like, space, x, best.J[..., : space.nb], draft=True)
    if trial.log_evidence > best.log_evidence - NEAR:
        trial = finished(trial)
    return trial if trial.log_evidence > best.log_evidence + WORTH else best


def restarted(best: Fitted) -> Fitted:
    """The model from other starts, where it leaves more than the noise of counting: where dry friction lets go, and
    where a gap closes, the likelihood has many maxima."""
    if loudness(best) < QUIET:
        return best
    rng = np.random.default_rng(0)
    nb, space = best.space.nb, best.space
    low, high = space.bounds()
    width = np.minimum(high - low, 2.0)[:nb]
    sizes = np.array([c.kind in (SIZE, INVERSE) for h in space.hypotheses for c in h.coordinates], bool)
    starts = [np.concatenate([np.zeros(nb), best.x[nb:]])]
    for share in SHARES:
        x = np.concatenate([np.zeros(nb), best.x[nb:]])
        x[nb:] = np.where(sizes, share * x[nb:], x[nb:])
        starts.append(x)
    for _ in range(DRAWS):
        x = best.x.copy()
        x[:nb] = np.clip(0.15 * width * rng.standard_normal(nb), low[:nb], high[:nb])
        starts.append(x)
    trial = max((refit(best.like, space, x, best.J, draft=True) for x in starts), key=lambda f: f.log_evidence)
    if trial.log_evidence > best.log_evidence - NEAR:
        trial = relaxed(finished(trial))
    return max(best, trial, key=lambda f: f.log_evidence)


def loudness(f: Fitted) -> float:
    """Rms of the residual by the least noise of its sensor, of the loudest sensor."""
    least = f.like.least * np.sqrt(f.like.mean)
    return float(np.max(np.sqrt(np.mean(f.e**2, axis=0)) / least))


def others(f: Fitted, index: int) -> list[Hypothesis]:
    """Other forms of one effect: with more parameters, and with each other setting."""
    h = f.space.hypotheses[index]
    return [*forms(h), *richer(f, h)]


def richer(f: Fitted, h: Hypothesis) -> list[Hypothesis]:
    """The effect with the further parameters of its richer form; none where it has none.

    What comes several times a turn may be a harmonic of what comes once.
    """
    term, sim = TERMS[h.term], f.like.sim
    found = standing(term, sim.elements, h.node)
    if not term.richer or is_rich(h) or (term.richer_at and (found is None or found[1].kind != term.richer_at)):
        return []
    measures = Measures(sim, f.model.base, {})
    own = {c.name for c in h.coordinates}
    out: list[Hypothesis] = []
    orders = [{}] if h.fixed.get(ORDER, 1.0) == 1.0 else [{}, {ORDER: 1.0}]
    for more, order in product(starts_of(h.term, h.node, term.richer, measures), orders):
        added = tuple(c for c in more.coordinates if c.name not in own)
        other = h._replace(coordinates=(*h.coordinates, *added), fixed={**h.fixed, **order, **more.fixed})
        if added and other not in out:
            out.append(other)
    return out


def exchanged(f: Fitted, index: int, other: Hypothesis) -> tuple[Space, np.ndarray]:
    """Space and start with one effect in another form, which begins where its coordinates were."""
    old, parts = f.space.hypotheses[index], f.space.parts(f.x)
    start = other.start()
    start[: len(old.coordinates)] = parts[index]
    parts[index] = start
    hypotheses = tuple(other if i == index else h for i, h in enumerate(f.space.hypotheses))
    return f.space._replace(hypotheses=hypotheses), np.concatenate([f.x[: f.space.nb], *parts])
