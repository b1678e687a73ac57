"""First look: whether the fit of the description alone lacks something, seconds after a diagnosis has begun."""

import numpy as np

from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.shares import floor

WORD = "first look"  # first words of the sentence, by which a display recognises it


def first_look(base: Fitted) -> str:
    """Sentence on the sensor with the largest ratio of residual to noise floor.

    Where no residual exceeds its floor, the correction of the observer may still show a missing force.
    """
    over = np.sqrt(np.mean(base.e**2, axis=0)) / floor(base)
    worst = int(np.argmax(over))
    if over[worst] <= 1.0:
        return f"{WORD}: the fitted description agrees with all sensors down to noise; missing forces are tested next"
    name = base.like.parts[0].sim.channels[worst]
    far = f"the residual of {name} under the fitted description is {over[worst]:.2g} times its noise"
    return f"{WORD}: something is missing: {far}"
