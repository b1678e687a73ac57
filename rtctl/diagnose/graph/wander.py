"""Force that comes and goes: what the observer had to push with, more slowly than it follows.

Noise of a sensor is quick: the observer averages over it. A force that no law explains and that has no pattern of its
own is slow enough to be followed. So what it pushes with, averaged over a few of its time constants, tells a machine
that lacks a force from a sensor that is noisy, whatever the colour of that noise.

Source: disturbance observer (Ohnishi, Shibata & Murakami, IEEE/ASME Trans. Mechatronics 1, 1996).
"""

from collections.abc import Sequence

import numpy as np

from rtctl.diagnose.graph.fits import Fitted
from rtctl.diagnose.graph.free import SIZE, Free
from rtctl.diagnose.graph.kernel import TRACK
from rtctl.diagnose.graph.measures import Measures

SLOW = 3.0  # time constants of the observer, over which it is averaged
LITTLE = 0.004  # of the force that moves the machine: standard deviation of what a description that is right leaves


def pushes(fit: Fitted) -> list[np.ndarray]:
    """Corrections (rows, followed) of the observer in each recording, N or Nm at the followed bodies."""
    return [part.sim.everything(part.sim.own(fit.model))[1][slice(*part.rows)] for part in fit.like.parts]


def wandering(fit: Fitted, pushed: Sequence[np.ndarray]) -> tuple[float, Free | None]:
    """Rms of the force that a fit leaves, by the force that moves the machine, and the force itself, of the recording
    and the followed body where it is largest; 0 and None where the model follows nothing. `pushed` is that of the fit.
    """
    share, worst = 0.0, None
    for part, push in zip(fit.like.parts, pushed, strict=True):
        sim = part.sim
        if sim.mode != TRACK:
            continue
        model = sim.own(fit.model)
        measures = Measures(sim, model.base, {})
        width = max(1, round(SLOW / sim.follow / sim.record.dt))
        count = len(push) // width
        if count < 2 or not np.isfinite(push).all():
            continue
        slow = push[: count * width].reshape(count, width, -1).mean(axis=1)
        t = sim.record.t[part.rows[0] :][: count * width].reshape(count, width).mean(axis=1) - sim.record.t[0]
        for number, one in enumerate(sim.followed):
            whole = measures.of("force", one.body)
            rms = float(np.std(slow[:, number])) / whole
            if rms > share:
                share = rms
                worst = Free(one.body, "time", SIZE, 0.0, fit.e, 0.0, t, slow[:, number], rms)
    return share, worst


def log_density(share: float, spread: float) -> float:
    """Logarithm of the probability density of a share whose standard deviation is `spread`, up to a constant."""
    return -0.5 * (share / spread) ** 2 - float(np.log(spread))
