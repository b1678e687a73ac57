"""Numbers of a model for prediction: those of the likelihood or those of least squares, by a free run of held-out rows.

The likelihood judges the next reading under a noise that knows what is slow: an error of a law at an event, as where a
carriage turns, moves all parameters. Least squares under a usual observer weighs by power, and slow errors move them.
Which of the two predicts a machine is asked of rows that no fit saw.

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

SLOWER = (1.0, 0.3)  # times the usual observer
ROUNDS = 20  # steps of least squares
WEIGHED = 2  # rounds, as the weights of several sensors are those of their residuals
MOST = 2  # models with further effects that are tried
ENOUGH = 1e-3  # of the cost, that a step must gain


def predictive(decided: Verdict, heldout: Heldout) -> Fitted:
    """The model that predicts a free run over the held-out rows best: that of the verdict, or one with further effects
    that are probable and not sure, each with the numbers of the likelihood or of least squares.

    It is that of the verdict where nothing is named, and where no observer follows the machine.
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
    """The model with those of its numbers that run freely over the whole recording best: its own, or those of least
    squares under observers that are slower and slower.

    All have as many numbers. The held-out rows alone are too few to choose by, where a machine adds up its errors.
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
    """The usual observer's quickness over that of the likelihood's own."""
    return min(1.0, like.sim.followed[0].bandwidth / like.sim.follow)


def at(f: Fitted, x: np.ndarray) -> Fitted:
    """The model with other numbers."""
    e = f.like.raw(f.space.model(x))
    return evaluated(f.like, f.space, Point(x, e, derivatives(f.like, f.space, x, range(len(x)))))


def probable(decided: Verdict) -> list[Fitted]:
    """Models with all effects of the verdict and others, likeliest first, that are not improbable."""
    best, chances = decided.best, dict(decided.probabilities)
    found = {r.fit.names: r.fit for r in decided.table if set(r.fit.names) > set(best.names)}
    likely = sorted(found, key=lambda names: -chances.get(names, 0.0))
    return [found[names] for names in likely[:MOST] if chances.get(names, 0.0) > 1.0 - SURE]


def least_squares(like: Likelihood, f: Fitted) -> np.ndarray:
    """Unknowns of a model by least squares of its residuals under the observer of `like`, from where they are."""
    like = like.slackened(None)
    e = like.raw(f.model)
    at = Point(f.x, e, derivatives(like, f.space, f.x, range(len(f.x))), ALL)
    for _ in range(WEIGHED):
        at = descend(like.flat(at.e), f.space, at, ROUNDS, ENOUGH)
    return at.x


def free_error(like: Likelihood, model: GraphModel) -> float:
    """Error of a free run over the rows of `like`, rms over its sensors, by the spread of each; inf where it runs
    away."""
    found = []
    for part in like.parts:
        begin, end = part.rows
        out = part.sim.released(begin).run(part.sim.own(model), n=end)[begin:, part.channels]
        told = [c for c, name in enumerate(part.sim.channels) if name not in part.sim.edges]
        e = (part.target[begin:end] - out)[:, told]
        beside = np.array([part.sim.channels[c] != part.sim.main for c in told])
        e = e - np.where(beside, e.mean(axis=0), 0.0)  # where they began to count says nothing
        found.append(np.mean(e**2, axis=0) / like.spread[told] ** 2)
    total = float(np.sqrt(np.mean(found)))
    return total if np.isfinite(total) else np.inf
