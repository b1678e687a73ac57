"""Posterior probabilities of the rivals: combinations of effects, the nominal model alone, and unnamed effects.

A probability is the mean of the posterior over resampled segments of the recording (a bagged posterior). Where two
models are both wrong, the posterior of one recording is close to one for either of them; the bagged posterior is not.
The law of a named effect has an error of some per cent: a small free force beside the effect counts for the name, a
large free force counts against the name.

Source: Huggins & Miller, Reproducible model selection using bagged posteriors, Bayesian Analysis 18 (2023);
Brynjarsdottir & O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse Problems 30
(2014).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import FREE_FORCE, LAW_ERROR_OF_FORCE, ODDS, UNEXPLAINED
from rtctl.diagnose.evidence.free import Free, free_functions
from rtctl.diagnose.evidence.places import AXES, TIME
from rtctl.diagnose.evidence.wander import log_density, wandering
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.pushes import pushes
from rtctl.diagnose.likelihood.shares import share_of
from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.search.search import Found
from rtctl.plants.physics import TERMS

SEGMENTS = 32  # resampled segments of a recording
DRAWS = 300  # bootstrap draws
BESIDE = 3  # combinations beside which free functions are fitted
NEAR = 50.0  # nats behind the best model, up to which free functions are fitted beside a model with a wrong number
LEAST = 1e-4  # of the force that moves a node: smallest discrepancy that is fitted


class Rival(NamedTuple):
    """Explanation of a recording, with its posterior."""

    fit: Fitted
    free: Free | None  # unnamed effect, or error of a law, beside the fit
    merit: float  # logarithm of the posterior on the whole recording, nats, up to a constant
    probability: float

    @property
    def doubted(self) -> str:
        """Path of the nominal number that is far out of its tolerance; empty where there is none."""
        return self.fit.space.doubted

    @property
    def unlisted(self) -> bool:
        """Whether the explanation has no name: a nominal number far out of its tolerance, or a free function larger
        than the error of a law."""
        return bool(self.doubted) or (self.free is not None and self.free.large)


def rivals(found: Found) -> tuple[Rival, ...]:
    """Rivals, the most probable first: all fitted models, and the likeliest of them with free functions."""
    base = found.base
    fits = list(found.fits) if any(not f.names for f in found.fits) else [*found.fits, base]
    sim = base.like.parts[0].sim
    unit = Measures(sim, base.model.base, {}).of("force", str(sim.body))

    def wrong(fit: Fitted) -> float:
        """Standard deviation of the error of the laws of a fit, as a share of the force that moves the machine: by the
        change of the tracking correction at the followed body, which includes effects in a sensor or a drive."""
        if not (fit.names or fit.space.doubted) or not len(fit.pushes[0]):
            return 0.0
        change = float(np.sqrt(np.mean((base.pushes[0] - fit.pushes[0])[:, 0] ** 2)))
        return LAW_ERROR_OF_FORCE * change / unit if np.isfinite(change) else 0.0

    def beside(fit: Fitted, off: float, axes: dict[str, float]) -> list[Free]:
        """Free functions beside a fit; the errors of its laws are along `axes`, each with its share of `off`."""
        return free_functions(fit, {axis: off * share for axis, share in axes.items() if off * share > LEAST})

    best = set(found.best.names)  # subsets of the best names are tested with free functions as well
    entries: list[tuple[Fitted, Free | None, float]] = []
    for rank, fit in enumerate(fits):
        off, wander, merit = wrong(fit), wandering(fit), found.merit(fit)
        listed = merit + wander.density(UNEXPLAINED, off)
        entries.append((fit, None, listed))
        if wander.free is not None:
            entries.append((fit, wander.free, merit + log_density(wander.share, FREE_FORCE) - ODDS))
        if rank < BESIDE or set(fit.names) < best:
            free = beside(fit, off, arguments(shares(fit)))
            large = [f for f in free if f.large and (not fit.names or exceeds(base, fit, f))]
            entries += [(fit, f, merit + f.evidence + own - ODDS) for f, own in _shared(large)]
            entries += [(fit, f, listed + f.evidence + own) for f, own in _small(free)]
    for fit in found.doubts:
        off, merit = wrong(fit), found.merit(fit) - ODDS - float(np.log(len(fit.space.names)))
        listed = merit + wandering(fit).density(UNEXPLAINED, off)
        entries.append((fit, None, listed))
        if merit > found.merit(found.best) - NEAR:
            free = beside(fit, off, dict.fromkeys(axes_of(fit.space.doubted), 1.0))
            entries += [(fit, f, listed + f.evidence + own) for f, own in _small(free)]
    losses = [losses_of(base.power, fit, free) for fit, free, _ in entries]
    chances = bagged(np.array([merit for *_, merit in entries]), np.array(losses))
    out = [Rival(fit, free, merit, float(p)) for (fit, free, merit), p in zip(entries, chances, strict=True)]
    return tuple(sorted(out, key=lambda r: -r.probability))


def losses_of(power: float, fit: Fitted, free: Free | None) -> np.ndarray:
    """Negative log-likelihood (segments,) of each segment of the recording, nats, times the share `power`."""
    return power * fit.like.losses(fit.e if free is None else free.e, SEGMENTS)


def arguments(shares: Sequence[tuple[str, float]]) -> dict[str, float]:
    """Share of the error of the laws by axis, from the share of each term in all effects: the error of a law is a
    function of the argument of the law, and small against its effect.

    A law whose argument is frequency or tension has no axis here: its error is along every axis but time.
    """
    out: dict[str, float] = {}
    for term, share in shares:
        axis = TERMS[term].axis
        along = {axis} if axis in AXES else set(AXES) - {TIME}
        for name in along | ({"position"} if axis == "angle" else set()):  # motion of less than a turn
            out[name] = float(np.hypot(out.get(name, 0.0), share))
    return out


def axes_of(number: str) -> set[str]:
    """Axes of the error of the law that a nominal number belongs to."""
    return {"command"} if number.startswith("drives.") else set(AXES) - {TIME, "command"}


def shares(fit: Fitted) -> list[tuple[str, float]]:
    """Term of each effect of a fit, and its share in the tracking correction; the squares of several shares sum to
    one."""
    terms = [h.term for h in fit.space.hypotheses]
    if len(terms) < 2 or not len(fit.pushes[0]):
        return [(term, 1.0) for term in terms]
    fewer = [fit.space.model_without(i, fit.x) for i in range(len(terms))]
    sizes = [
        np.sqrt(
            sum(float(np.sum((one - own) ** 2)) for one, own in zip(pushes(fit.like, model), fit.pushes, strict=True))
        )
        for model in fewer
    ]
    total = float(np.linalg.norm(sizes))
    told = np.isfinite(total) and total > 0.0
    return [(term, float(size / total) if told else 1.0) for term, size in zip(terms, sizes, strict=True)]


def exceeds(base: Fitted, fit: Fitted, free: Free) -> bool:
    """Whether a free force beside a fit reduces the residual by more than the error of the laws of the fit."""
    return share_of(base.e, fit.e, free.e) > LAW_ERROR_OF_FORCE


def bagged(merits: np.ndarray, losses: np.ndarray) -> np.ndarray:
    """Bagged posterior (rivals,): mean over resampled segments, from merits (rivals,) on the whole recording and losses
    (rivals, segments), nats."""
    count = losses.shape[1]
    weights = np.random.default_rng(0).multinomial(count, np.full(count, 1.0 / count), DRAWS)
    drawn = (merits + losses.sum(axis=1)) - weights @ losses.T
    odds = np.exp(drawn - drawn.max(axis=1, keepdims=True))
    return np.asarray((odds / odds.sum(axis=1, keepdims=True)).mean(axis=0))


def _small(free: list[Free]) -> list[tuple[Free, float]]:
    """Errors of the laws among free functions, each with its log prior, nats."""
    return _shared([f for f in free if not f.large])


def _shared(free: list[Free]) -> list[tuple[Free, float]]:
    """Free functions of one size, each with its log prior, nats: all share one prior probability. Beside a large
    function the time-varying force is as small as the error of a law."""
    each = -float(np.log(max(len(free), 1)))
    return [
        (f, each + (log_density(0.0, float(np.hypot(UNEXPLAINED, LAW_ERROR_OF_FORCE * f.rms))) if f.large else 0.0))
        for f in free
    ]
