"""Bandwidth of the observer: a parameter of the noise of a recording, estimated by the likelihood.

A precise sensor beside a force without a law needs a fast observer: the one that predicts the next reading best. Under
a slow observer a model reverses at another time than the machine, and so does its dry friction.

Source: innovation form of a state space model, Ljung, System Identification (1999), ch. 4.3.
"""

import numpy as np

from rtctl.diagnose.calibration import QUICKER, QUIET
from rtctl.diagnose.likelihood.fits import Fitted, refit
from rtctl.diagnose.model.kernel import TRACK

STEP = 2.0  # ratio of two neighbouring bandwidths


def quicker(fit: Fitted) -> float:
    """Factor of the bandwidth at which a model predicts its recording best; 1 where the gain is small."""
    best, times = fit, 1.0
    while best.like.parts[0].sim.follow < best.like.parts[0].sim.quickest and lags(best):
        again = refit(fit.like.following(times * STEP), fit.space, best.x)
        if again.log_evidence <= best.log_evidence:
            break
        best, times = again, times * STEP
    return times if best.log_evidence > fit.log_evidence + QUICKER else 1.0


def lags(fit: Fitted) -> bool:
    """Whether a model lags behind a followed sensor by more than the noise of the sensor.

    Below this noise a faster observer follows single counts, and their pattern is taken for an effect.
    """
    like, sim = fit.like, fit.like.parts[0].sim
    rms = dict(zip(like.channels, np.std(fit.e, axis=0) / like.least, strict=True))
    return sim.mode == TRACK and any(rms.get(sim.column(one.sensor), 0.0) > QUIET[0] for one in sim.followed)
