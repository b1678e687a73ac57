"""Time-varying unnamed force: the tracking correction, averaged over windows longer than the observer's response
(pushes.py).

The force separates a missing force without a pattern from sensor noise of any colour.
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
    """Time-varying force at the followed body, and in the recording, where it is largest."""

    share: float = 0.0  # rms, by the force that moves the machine
    noise: float = 0.0  # rms from sensor noise alone, by the force that moves the machine
    free: Free | None = None  # the force itself; None where the model follows nothing

    def density(self, *usual: float) -> float:
        """Log density of `share` under sensor noise and the standard deviations `usual`, by the force that moves the
        machine."""
        return log_density(self.share, float(np.linalg.norm([*usual, self.noise])))


def wandering(fit: Fitted) -> Wander:
    """Time-varying force in the tracking correction of a fit."""
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
    """Standard deviation, N or Nm, of the windowed tracking correction from the noise of a followed sensor alone;
    windows are `width` ticks apart, `inertia` is that of the followed body, kg or kg m^2."""
    sim, one = part.sim, part.sim.followed[number]
    if one.shows_speed or sim.column(one.sensor) not in part.channels:
        return 0.0
    noise = part.noise[part.channels.index(sim.column(one.sensor))].averaged()
    return float(noise.sigma) * np.sqrt(part.mean) * inertia * answer(sim.bandwidth(one), sim.record.dt, width)


def log_density(share: float, spread: float) -> float:
    """Log density of a normal share of standard deviation `spread`, nats, up to a constant."""
    return -0.5 * (share / spread) ** 2 - float(np.log(spread))
