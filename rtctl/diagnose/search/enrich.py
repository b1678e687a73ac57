"""Other forms of the effects of a model: harmonics, a second branch, another shape of the law."""

from itertools import product

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted, finished, refit, relaxed
from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.model.space import INVERSE, SIZE, Hypothesis, Space
from rtctl.diagnose.search.extend import NEAR
from rtctl.diagnose.search.grid_starts import starts_of
from rtctl.diagnose.search.term_variants import forms, is_rich
from rtctl.plants.physics import TERMS, standing

ORDER = "order"  # setting of a wave: order, per turn
ROUNDS = 2  # rounds of other forms: a further parameter may need another setting
WORTH = 2.0  # nats of evidence: least gain of another form
QUIET = 3.0  # times the least noise: rms of a residual below which one maximum is enough
SHARES = (0.4, 2.5, 7.0)  # factors of a size, at other starts
DRAWS = 2  # starts with random nominal values


def enriched(best: Fitted) -> Fitted:
    """Model with each effect in the form with the highest evidence."""
    for index in range(len(best.space.hypotheses)):
        for _ in range(ROUNDS):
            before = best
            for other in others(best, index):
                best = _better(best, index, other)
            if best is before:
                break
    return best


def _better(best: Fitted, index: int, other: Hypothesis) -> Fitted:
    """Model with one effect in another form where the evidence gains WORTH, else the unchanged model."""
    space, x = exchanged(best, index, other)
    trial = refit(best.like, space, x, best.J[..., : space.nb], draft=True)
    if trial.log_evidence > best.log_evidence - NEAR:
        trial = finished(trial)
    return trial if trial.log_evidence > best.log_evidence + WORTH else best


def restarted(best: Fitted) -> Fitted:
    """Model with the highest evidence of several starts, where its residual exceeds counting noise.

    The likelihood has many maxima where dry friction breaks away, and where a gap closes.
    """
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
    """Largest ratio of the rms of a residual to the least noise of its sensor."""
    least = f.like.least * np.sqrt(f.like.mean)
    return float(np.max(np.sqrt(np.mean(f.e**2, axis=0)) / least))


def others(f: Fitted, index: int) -> list[Hypothesis]:
    """Other forms of one effect: with more parameters, and with each other setting."""
    h = f.space.hypotheses[index]
    return [*forms(h), *richer(f, h)]


def richer(f: Fitted, h: Hypothesis) -> list[Hypothesis]:
    """Hypotheses of an effect with the further parameters of its richer form; none where it has no richer form.

    An effect that repeats several times a turn may be a harmonic of an effect of order one.
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
    """Space and start (unknowns,) with one effect in another form, from the fitted values of its coordinates."""
    old, parts = f.space.hypotheses[index], f.space.parts(f.x)
    start = other.start()
    start[: len(old.coordinates)] = parts[index]
    parts[index] = start
    hypotheses = tuple(other if i == index else h for i, h in enumerate(f.space.hypotheses))
    return f.space._replace(hypotheses=hypotheses), np.concatenate([f.x[: f.space.nb], *parts])
