"""Intervals of a fit: half widths of 90 % intervals, and effects whose size may be zero."""

import numpy as np

from rtctl.diagnose.calibration import INNOVATIONS_OF_INTERVAL
from rtctl.diagnose.likelihood.fits import Fitted, curvature
from rtctl.diagnose.likelihood.likelihood import coarsened
from rtctl.diagnose.model.space import COSINE, REST, SINE, SIZE

Z90 = 1.645  # standard deviations of a 90 % interval, each way


def half_widths(f: Fitted) -> np.ndarray:
    """Half width (unknowns,) of the 90 % interval of each unknown, as an answer reports it.

    The posterior for an interval counts few innovations: the error of a law moves its parameters more than noise.
    """
    information = curvature(f, coarsened(f.like.size, INNOVATIONS_OF_INTERVAL))
    return np.asarray(Z90 * np.sqrt(np.maximum(np.diag(np.linalg.pinv(information)), 0.0)))


def faint(f: Fitted) -> list[int]:
    """Indices of the effects of a model whose sizes may all be zero, by their 90 % intervals."""
    half, out = half_widths(f), []
    for index, h in enumerate(f.space.hypotheses):
        columns = f.space.columns(index)
        x, reach = f.x[columns], half[columns]
        sizes = [along(x[i : i + 2], reach[i : i + 2]) if h.coordinates[i].kind == COSINE else (abs(x[i]), reach[i])
                 for i in h.sizes if h.coordinates[i].kind != SINE]  # fmt: skip
        if sizes and all(size < width for size, width in sizes):
            out.append(index)
    return out


def hollow(f: Fitted) -> list[int]:
    """Indices of the effects of which only the force at their place of rest is determined.

    The size of the effect itself may be zero by its 90 % interval.
    """
    half, out = half_widths(f), []
    for index, h in enumerate(f.space.hypotheses):
        columns = f.space.columns(index)
        told = np.abs(f.x[columns]) >= half[columns]
        own, rests = (told[[c.kind == kind for c in h.coordinates]] for kind in (SIZE, REST))
        if rests.any() and not own.any():
            out.append(index)
    return out


def along(pair: np.ndarray, half: np.ndarray) -> tuple[float, float]:
    """Amplitude of cosine and sine parts (2,), and its half width at the fitted phase, by their half widths (2,)."""
    amplitude = float(np.hypot(*pair))
    return amplitude, float(np.hypot(*(pair * half)) / max(amplitude, 1e-12))
