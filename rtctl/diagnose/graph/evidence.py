"""Evidence: combinations of effects, the description alone and forces without a name are rivals for one probability.

A probability is the mean of the posterior over resampled segments of the recording (a bagged posterior). Where two
models are both wrong, the posterior of one recording is sure of either; the mean over what could have been recorded
is not. The law of a name is exact to some per cent alone: a small free force beside it counts for the name, a large
one against it.

Source: Huggins & Miller, Reproducible model selection using bagged posteriors, Bayesian Analysis 18 (2023);
Brynjarsdottir & O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse Problems 30
(2014).
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.graph.fits import Fitted
from rtctl.diagnose.graph.free import SIZE, Free, free_forces
from rtctl.diagnose.graph.search import Found

SEGMENTS = 32
DRAWS = 300
DISCREPANCY = 0.2  # of the missing force: standard deviation of what the law of a name may be wrong by
UNLISTED = 3.0  # nats: prior odds against a force that has no name
BESIDE = 3  # combinations beside which free forces are asked for
LEAST = 1e-4  # of the force that moves a node: a discrepancy that is smaller is none


class Rival(NamedTuple):
    """One explanation of a recording."""

    fit: Fitted
    free: Free | None  # a force without a name beside the fit
    merit: float  # logarithm of the posterior on the whole recording, nats, up to a constant
    probability: float

    @property
    def unlisted(self) -> bool:
        """Whether the free force is more than what the law of a name may be wrong by."""
        return self.free is not None and self.free.share == SIZE


def rivals(found: Found) -> tuple[Rival, ...]:
    """All explanations that were fitted, with free forces beside the likeliest; the most probable first."""
    base = found.base
    fits = list(found.fits) if any(not f.names for f in found.fits) else [*found.fits, base]
    entries: list[tuple[Fitted, Free | None, float]] = [(f, None, found.merit(f)) for f in fits]
    missing = free_forces(base)
    whole = DISCREPANCY * missing[0].rms if missing else 0.0
    entries += _beside(found, base, missing)
    for fit in found.fits[:BESIDE]:
        if fit.names:
            shares = (SIZE, *((whole,) if whole > LEAST else ()))
            for share in shares:
                entries += _beside(found, fit, [f for f in free_forces(fit, shares) if f.share == share])
    losses = [base.power * _losses(found, fit.e if free is None else free.e) for fit, free, _ in entries]
    chances = bagged(np.array([merit for *_, merit in entries]), np.array(losses))
    out = [Rival(fit, free, merit, float(p)) for (fit, free, merit), p in zip(entries, chances, strict=True)]
    return tuple(sorted(out, key=lambda r: -r.probability))


def bagged(merits: np.ndarray, losses: np.ndarray) -> np.ndarray:
    """Mean posterior (rivals,) over resampled segments, of merits (rivals,) on the whole and losses (rivals, segments)
    that are part of them."""
    count = losses.shape[1]
    weights = np.random.default_rng(0).multinomial(count, np.full(count, 1.0 / count), DRAWS)
    drawn = (merits + losses.sum(axis=1)) - weights @ losses.T
    odds = np.exp(drawn - drawn.max(axis=1, keepdims=True))
    return np.asarray((odds / odds.sum(axis=1, keepdims=True)).mean(axis=0))


def _losses(found: Found, e: np.ndarray) -> np.ndarray:
    return found.like.losses(e, SEGMENTS)


def _beside(found: Found, fit: Fitted, free: list[Free]) -> list[tuple[Fitted, Free | None, float]]:
    """Free forces of one size beside a fit; the prior is shared among them."""
    toll = float(np.log(max(len(free), 1))) + (UNLISTED if free and free[0].share == SIZE else 0.0)
    return [(fit, f, found.merit(fit) + f.evidence - toll) for f in free]
