"""Corrections of the tracking observer, averaged over windows: forces that the model lacks, without sensor noise.

Sensor noise is fast, and the observer averages it. A force without a law is slow enough to be followed: the correction
contains it. The correction of a fast observer is mostly noise. A smooth window removes this noise; the mean over a box
keeps the noise of its two ends.

Source: disturbance observer (Ohnishi, Shibata & Murakami, IEEE/ASME Trans. Mechatronics 1, 1996).
"""

from functools import cache

import numpy as np
from scipy.signal import lfilter

from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.observer import DAMPED, SMOOTHED, stiffness

LONG = 100  # windows of simulated noise, for the standard deviation of an average


def pushes(like: Likelihood, model: GraphModel) -> tuple[np.ndarray, ...]:
    """Corrections (windows, followed) of the observer in each recording, N or Nm at the followed bodies.

    There are no windows where no observer follows the machine.
    """
    out = []
    for part in like.parts:
        if part.sim.mode == TRACK:
            push = part.sim.everything(part.sim.own(model), n=part.rows[1])[1][part.rows[0] :]
            out.append(averaged(push, part.sim.window))
        else:
            out.append(np.zeros((0, len(part.sim.followed))))
    return tuple(out)


def averaged(push: np.ndarray, width: int) -> np.ndarray:
    """Means (windows, k) of values (rows, k) over Hann windows that lie `width` rows apart, and are twice as long."""
    count = max(len(push) // width - 1, 0)
    rise, fall = (np.hanning(2 * width + 1)[:-1] / width).reshape(2, width)
    cells = push[: (count + 1) * width].reshape(-1, width, push.shape[1])
    up, down = (np.tensordot(half, cells, (0, 1)) for half in (rise, fall))
    return np.asarray(up[:-1] + down[1:]) if count else np.zeros((0, push.shape[1]))


@cache
def answer(follow: float, dt: float, width: int) -> float:
    """Standard deviation of averaged corrections by white sensor noise of standard deviation one, for an inertia of
    one.

    Windows are `width` ticks of dt, s, apart. The bandwidth of the observer is `follow`, rad/s.
    """
    w = follow * dt
    white = np.random.default_rng(0).standard_normal(LONG * width)
    e = lfilter([1.0, -2.0, 1.0], [1.0, DAMPED * w - 2.0, 1.0 - DAMPED * w + w**2], white)
    a = -np.expm1(-SMOOTHED * w)
    rate = lfilter([a], [1.0, a - 1.0], np.diff(e, prepend=e[0])) / dt
    by_error, by_rate = stiffness(follow, 1.0)
    push = by_error * e + by_rate * rate
    return float(np.std(averaged(push[:, None], width)))
