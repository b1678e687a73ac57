"""Force that comes and goes: what the observer had to push with, more slowly than it follows (pushes.py).

It tells a machine that lacks a force, without a pattern of its own, from a sensor that is noisy, whatever the colour of
that noise.
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.evidence.free import Free
from rtctl.diagnose.evidence.places import TIME, Place
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.pushes import answer, averaged
from rtctl.diagnose.model.node_scaling import Measures


class Wander(NamedTuple):
    """Force that comes and goes, of the recording and the followed body where it is largest."""

    share: float = 0.0  # rms, by the force that moves the machine
    noise: float = 0.0  # what noise of the sensor makes of it, the same way
    free: Free | None = None  # the force itself; None where the model follows nothing

    def density(self, *usual: float) -> float:
        """Logarithm of the probability density of the force where it is sensor noise and what is `usual`, standard
        deviations by the same force."""
        return log_density(self.share, float(np.linalg.norm([*usual, self.noise])))


def wandering(fit: Fitted) -> Wander:
    """The force that a fit leaves."""
    worst = Wander()
    for part, slow in zip(fit.like.parts, fit.pushes, strict=True):
        sim = part.sim
        if len(slow) < 2 or not np.isfinite(slow).all():
            continue
        measures, width = Measures(sim, sim.own(fit.model).base, {}), sim.window
        t = averaged(sim.record.t[slice(*part.rows)][:, None], width)[:, 0] - sim.record.t[0]
        for number, one in enumerate(sim.followed):
            whole = measures.of("force", one.body)
            rms = float(np.std(slow[:, number])) / whole
            if rms > worst.share:
                place = Place(one.body, TIME, [sim.record.t], whole, False)
                free = Free(place, True, 0.0, fit.e, 0.0, t, slow[:, number], rms)
                worst = Wander(rms, heard(part, number, width, measures.inertia(one.body)) / whole, free)
    return worst


def heard(part: Likelihood, number: int, width: int, inertia: float) -> float:
    """Standard deviation of the mean over windows `width` ticks apart of what the observer makes of the noise of a
    followed sensor, N or Nm at its body, which feels an inertia of `inertia`."""
    sim, one = part.sim, part.sim.followed[number]
    if one.shows_speed or sim.column(one.sensor) not in part.channels:
        return 0.0
    noise = part.noise[part.channels.index(sim.column(one.sensor))].averaged()
    return float(noise.sigma) * np.sqrt(part.mean) * inertia * answer(sim.bandwidth(one), sim.record.dt, width)


def log_density(share: float, spread: float) -> float:
    """Logarithm of the probability density of a share whose standard deviation is `spread`, up to a constant."""
    return -0.5 * (share / spread) ** 2 - float(np.log(spread))
