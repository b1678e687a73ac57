"""Force that comes and goes: what the observer had to push with, more slowly than it follows.

Noise of a sensor is quick: the observer averages over it. A force that no law explains and that has no pattern of its
own is slow enough to be followed. So what the observer pushes with, averaged over a few time constants of a usual one,
tells a machine that lacks a force from a sensor that is noisy, whatever the colour of that noise. A quick observer
pushes with noise mostly: a smooth window takes it off, where the mean over a box keeps the noise of its two ends.

Source: disturbance observer (Ohnishi, Shibata & Murakami, IEEE/ASME Trans. Mechatronics 1, 1996).
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from rtctl.diagnose.graph.fits import Fitted
from rtctl.diagnose.graph.free import SIZE, Free
from rtctl.diagnose.graph.kernel import TRACK
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.graph.measures import Measures
from rtctl.diagnose.graph.observer import DAMPED, SMOOTHED
from rtctl.diagnose.graph.simulate import Simulator

SLOW = 3.0  # time constants of a usual observer: distance of the windows over which a force is averaged
LONG = 100  # windows of noise, by which its part is measured
LITTLE = 0.004  # of the force that moves the machine: standard deviation of what a description that is right leaves


def pushes(fit: Fitted) -> list[np.ndarray]:
    """Corrections (rows, followed) of the observer in each recording, N or Nm at the followed bodies."""
    return [part.sim.everything(part.sim.own(fit.model))[1][slice(*part.rows)] for part in fit.like.parts]


class Wander(NamedTuple):
    """Force that comes and goes, of the recording and the followed body where it is largest."""

    share: float = 0.0  # rms, by the force that moves the machine
    noise: float = 0.0  # what noise of the sensor makes of it, the same way
    free: Free | None = None  # the force itself; None where the model follows nothing


def wandering(fit: Fitted, pushed: Sequence[np.ndarray]) -> Wander:
    """The force that a fit leaves; `pushed` is what its observer pushed with."""
    worst = Wander()
    for part, push in zip(fit.like.parts, pushed, strict=True):
        sim = part.sim
        if sim.mode != TRACK:
            continue
        model = sim.own(fit.model)
        measures = Measures(sim, model.base, {})
        width = apart(sim)
        slow = averaged(push, width)
        if len(slow) < 2 or not np.isfinite(slow).all():
            continue
        t = averaged(sim.record.t[slice(*part.rows)][:, None], width)[:, 0] - sim.record.t[0]
        for number, one in enumerate(sim.followed):
            whole = measures.of("force", one.body)
            rms = float(np.std(slow[:, number])) / whole
            if rms > worst.share:
                free = Free(one.body, "time", SIZE, 0.0, fit.e, 0.0, t, slow[:, number], rms)
                worst = Wander(rms, heard(part, number, width, measures.inertia(one.body)) / whole, free)
    return worst


def apart(sim: Simulator) -> int:
    """Ticks from one window to the next."""
    return max(1, round(SLOW / min(sim.followed[0].bandwidth, sim.follow) / sim.record.dt))


def averaged(push: np.ndarray, width: int) -> np.ndarray:
    """Means (windows, k) of values (rows, k) over Hann windows that lie `width` rows apart, and are twice as long."""
    count = max(len(push) // width - 1, 0)
    rise, fall = (np.hanning(2 * width + 1)[:-1] / width).reshape(2, width)
    cells = push[: (count + 1) * width].reshape(-1, width, push.shape[1])
    up, down = (np.tensordot(half, cells, (0, 1)) for half in (rise, fall))
    return np.asarray(up[:-1] + down[1:]) if count else np.zeros((0, push.shape[1]))


def heard(part: Likelihood, number: int, width: int, inertia: float) -> float:
    """Standard deviation of the mean over windows `width` ticks apart of what the observer makes of the noise of a
    followed sensor, N or Nm at its body, which feels an inertia of `inertia`."""
    sim, one = part.sim, part.sim.followed[number]
    if one.shows_speed or sim.column(one.sensor) not in part.channels:
        return 0.0
    noise = part.noise[part.channels.index(sim.column(one.sensor))].averaged()
    return float(noise.sigma) * np.sqrt(part.mean) * inertia * answer(sim.bandwidth(one), sim.record.dt, width)


@cache
def answer(follow: float, dt: float, width: int) -> float:
    """Standard deviation of the mean over windows, `width` ticks of dt s apart, of what an observer of bandwidth
    `follow`, rad/s, makes of white noise of standard deviation one, for a unit of inertia."""
    w = follow * dt
    white = np.random.default_rng(0).standard_normal(LONG * width)
    e = lfilter([1.0, -2.0, 1.0], [1.0, DAMPED * w - 2.0, 1.0 - DAMPED * w + w**2], white)
    a = -np.expm1(-SMOOTHED * w)
    rate = lfilter([a], [1.0, a - 1.0], np.diff(e, prepend=e[0])) / dt
    push = follow**2 * e + DAMPED * follow * rate
    return float(np.std(averaged(push[:, None], width)))


def log_density(share: float, spread: float) -> float:
    """Logarithm of the probability density of a share whose standard deviation is `spread`, up to a constant."""
    return -0.5 * (share / spread) ** 2 - float(np.log(spread))
