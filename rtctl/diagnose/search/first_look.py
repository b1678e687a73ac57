"""What the fit of the description alone says, seconds after a diagnosis has begun: whether something is missing."""

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import floor

WORD = "first look"  # that the sentence begins with, for those who show it


def first_look(base: Fitted) -> str:
    """One sentence on the sensor that the fitted description follows worst. Where none is off by more than its noise, a
    force that the observer needed may still tell something."""
    over = np.sqrt(np.mean(base.e**2, axis=0)) / floor(base)
    worst = int(np.argmax(over))
    if over[worst] <= 1.0:
        return f"{WORD}: the fitted description follows every sensor down to its noise; forces are weighed next"
    name = base.like.parts[0].sim.channels[worst]
    far = f"{over[worst]:.2g} times as far from the fitted description as noise explains"
    return f"{WORD}: something is missing: {name} is {far}"
