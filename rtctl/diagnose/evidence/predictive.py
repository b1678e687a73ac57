"""Parameters of a model for prediction: of maximum likelihood or of least squares, by a free run over held-out rows.

Maximum likelihood weighs one-step predictions under coloured noise: an error of a law at an event, as a reversal, moves
all parameters. Least squares under the usual observer weighs by power: slow errors move the parameters. Held-out rows
decide which of the two predicts the machine.

Source: Ljung, System Identification (1999), ch. 8.5 (the prefilter decides where a model that is not exact fits).
"""

import numpy as np

from rtctl.diagnose.calibration import SURE
from rtctl.diagnose.evidence.diagnosis import AMBIGUOUS, NAMED
from rtctl.diagnose.evidence.prediction import Heldout, fitted_to
from rtctl.diagnose.evidence.verdict import Verdict
from rtctl.diagnose.likelihood.descent import ALL, Point, derivatives, descend
from rtctl.diagnose.likelihood.fits import Fitted, evaluated
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import GraphModel

SLOWER = (1.0, 0.3)  # bandwidths over that of the usual observer
ROUNDS = 20  # steps of least squares
WEIGHED = 2  # rounds of reweighting the sensors by their residuals
MOST = 2  # models with further effects that are tried
ENOUGH = 1e-3  # of the cost: least gain of a step


def predictive(decided: Verdict, heldout: Heldout) -> Fitted:
    """Model with the best free run over the held-out rows: the model of the verdict, or a model with further probable
    effects, each with the parameters of maximum likelihood or of least squares.

    The model of the verdict is returned where nothing is named, and where no observer follows the machine.
    """
    best = decided.best
    like = best.like
    if decided.verdict not in (NAMED, AMBIGUOUS) or not followed(like):
        return best
    tried: list[tuple[float, Fitted, bool]] = []
    for f in (best, *probable(decided)):
        early = heldout.fits[1] if f is best else fitted_to(heldout.early, f)
        plain = f.space.model(least_squares(early.like.following(usual(like)), early))
        tried += [(free_error(heldout.late, early.model), f, False), (free_error(heldout.late, plain), f, True)]
    _, f, by_squares = min(tried, key=lambda one: one[0])
    if not by_squares:
        return f
    return at(f, least_squares(like.following(usual(like)), f))


def freest(f: Fitted) -> Fitted:
    """Model with the parameters of the best free run over the whole recording: its own, or those of least squares under
    the usual observer or a slower one.

    The number of parameters is equal for all. Held-out rows are too few for this choice where a machine integrates its
    errors.
    """
    like = f.like
    if not f.names or not followed(like):
        return f
    found = [f.x, *(least_squares(like.following(usual(like) * slower), f) for slower in SLOWER)]
    errors = [free_error(like, f.space.model(x)) for x in found]
    best = int(np.argmin(errors))
    return f if best == 0 or not np.isfinite(errors[best]) else at(f, found[best])


def followed(like: Likelihood) -> bool:
    """Whether an observer follows the machine in every recording."""
    return all(part.sim.mode == TRACK for part in like.parts)


def usual(like: Likelihood) -> float:
    """Bandwidth of the usual observer over that of the observer of the likelihood, at most 1."""
    return min(1.0, like.sim.followed[0].bandwidth / like.sim.follow)


def at(f: Fitted, x: np.ndarray) -> Fitted:
    """Model evaluated at other unknowns x (unknowns,)."""
    e = f.like.raw(f.space.model(x))
    return evaluated(f.like, f.space, Point(x, e, derivatives(f.like, f.space, x, range(len(x)))))


def probable(decided: Verdict) -> list[Fitted]:
    """Probable models with all effects of the verdict and further ones, likeliest first."""
    best, chances = decided.best, dict(decided.probabilities)
    found = {r.fit.names: r.fit for r in decided.table if set(r.fit.names) > set(best.names)}
    likely = sorted(found, key=lambda names: -chances.get(names, 0.0))
    return [found[names] for names in likely[:MOST] if chances.get(names, 0.0) > 1.0 - SURE]


def least_squares(like: Likelihood, f: Fitted) -> np.ndarray:
    """Unknowns (unknowns,) by least squares of the residuals under the observer of `like`, from the present ones."""
    like = like.slackened(None)
    e = like.raw(f.model)
    at = Point(f.x, e, derivatives(like, f.space, f.x, range(len(f.x))), ALL)
    for _ in range(WEIGHED):
        at = descend(like.flat(at.e), f.space, at, ROUNDS, ENOUGH)
    return at.x


def free_error(like: Likelihood, model: GraphModel) -> float:
    """Free-run error over the rows of `like`: rms over the sensors, by the spread of each; inf where the model
    diverges."""
    found = []
    for part in like.parts:
        begin, end = part.rows
        out = part.sim.released(begin).run(part.sim.own(model), n=end)[begin:, part.channels]
        told = [c for c, name in enumerate(part.sim.channels) if name not in part.sim.edges]
        e = (part.target[begin:end] - out)[:, told]
        beside = np.array([part.sim.channels[c] != part.sim.main for c in told])
        e = e - np.where(beside, e.mean(axis=0), 0.0)  # the offset of a counter is arbitrary
        found.append(np.mean(e**2, axis=0) / like.spread[told] ** 2)
    total = float(np.sqrt(np.mean(found)))
    return total if np.isfinite(total) else np.inf
