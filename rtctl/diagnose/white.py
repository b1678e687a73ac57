"""A recording through the filter that makes white noise of what a model leaves of it.

What random forces leave wanders for as long as the correction remembers, and a small effect drowns in it. But each
error is foretold by those just before it to the noise of one tick, and beside that alone the effect stands out.

Source: Ljung, System Identification (1999), 3.2 and 7.2, for the filter that a prediction error passes.
"""

import numpy as np
from scipy.signal import lfilter

from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem

ORDER = 40  # errors that foretell the next one
PART = 20  # at the most one of so many: few errors say little of a filter
RIDGE = 1e-6  # of the errors' power


class White(Problem):
    """A problem whose errors are those of another one through the filter that makes the errors r white, with noise of
    unit size. Each sensor has its own."""

    together = 1.0

    def __init__(self, problem: Problem, r: np.ndarray):
        self.__dict__.update(problem.__dict__)
        self.taps = {int(sensor): taps_of(r[self.source == sensor]) for sensor in np.unique(self.source)}

    @property
    def floor(self) -> float:
        """Of unit size."""
        return 1.0

    def residual(self, model: Model, coarse: bool = False, at: str = "") -> np.ndarray:
        """As of any problem."""
        return self.through(super().residual(model, coarse, at))

    def through(self, errors: np.ndarray) -> np.ndarray:
        """Errors (errors, ...) through the filter; the first of each sensor, which nothing foretells, are left out."""
        out = np.zeros_like(errors)
        for sensor, taps in self.taps.items():
            passed = lfilter(taps, [1.0], errors[self.source == sensor], axis=0)
            passed[: len(taps) - 1] = 0.0
            out[self.source == sensor] = passed
        return out


def taps_of(e: np.ndarray) -> np.ndarray:
    """The filter (taps,) that leaves of each of the errors e what those before do not foretell, by its own rms."""
    order = min(ORDER, len(e) // PART)
    taps = np.ones(1)
    if order > 0:
        off = e - e.mean()
        past = np.column_stack([off[order - k - 1 : len(e) - k - 1] for k in range(order)])
        ridge = RIDGE * float(off @ off) * np.eye(order)
        taps = np.concatenate((taps, -np.linalg.solve(past.T @ past + ridge, past.T @ off[order:])))
    return taps / (float(np.std(lfilter(taps, [1.0], e)[order:])) or 1.0)
