"""Bandwidth of the observer: part of the noise of a recording, and told by the same likelihood.

A sensor that is precise, beside a force that no law has, asks for an observer that is quick: the one that foretells the
next reading best. One that is too slow lets a model turn at another moment than the machine, and dry friction with it.

Source: innovation form of a state space model, Ljung, System Identification (1999), ch. 4.3.
"""

import numpy as np

from rtctl.diagnose.calibration import QUICKER, QUIET
from rtctl.diagnose.likelihood.fits import Fitted, refit
from rtctl.diagnose.model.kernel import TRACK

STEP = 2.0  # from one bandwidth to the next


def quicker(fit: Fitted) -> float:
    """Times the usual bandwidth at which a model foretells its recording best; 1 where that brings little."""
    best, times = fit, 1.0
    while best.like.parts[0].sim.follow < best.like.parts[0].sim.quickest and lags(best):
        again = refit(fit.like.following(times * STEP), fit.space, best.x)
        if again.log_evidence <= best.log_evidence:
            break
        best, times = again, times * STEP
    return times if best.log_evidence > fit.log_evidence + QUICKER else 1.0


def lags(fit: Fitted) -> bool:
    """Whether a model lags behind a sensor that it follows by more than the sensor's noise. Below that an observer that
    is quicker follows single counts, and whatever has their pattern is held for an effect."""
    like, sim = fit.like, fit.like.parts[0].sim
    rms = dict(zip(like.channels, np.std(fit.e, axis=0) / like.least, strict=True))
    return sim.mode == TRACK and any(rms.get(sim.column(one.sensor), 0.0) > QUIET[0] for one in sim.followed)
