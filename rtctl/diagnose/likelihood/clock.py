"""Timing errors of the ticks: estimated from sensor noise that grows with the rate of the reading.

A tick that is late by d shows a reading that is d times its rate further on. All sensors share the d of a tick. Timing
errors also move the machine: a command acts until the next one is written. A law with a derivative answers a late
reading, which is ahead, with a command against the motion, and this command is cut short. The mean is a force along the
motion, proportional to the variance of d. `timed` estimates each d from the residual and holds each command for its
actual time.

Source: Cervin et al., How does control timing affect performance, IEEE Control Systems 23(3) (2003).
"""

from copy import copy
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.special import expit, logsumexp

from rtctl.diagnose.calibration import CHANCE, CLOCK, INNOVATIONS_OF_INTERVAL, ODDS
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.joint import Joint
from rtctl.diagnose.likelihood.likelihood import Likelihood, coarsened
from rtctl.diagnose.likelihood.noise import levels, surprise
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.simulate import Simulator
from rtctl.plants.physics import TERMS

MOST = 0.5  # share of a tick: largest standard deviation of the timing error
GRID = 60  # standard deviations that are tried, equally spaced in logarithm
SLOW, PUSH = 21, 41  # ticks: window of slow residuals, which are no timing error; window of an averaged force
TAIL = 0.05  # probability beyond each end of a 90 % interval
UNSTEADY = next((t.name, t.stands[0].element, *t.typical) for t in TERMS.values() if t.clock)  # term, node, size


class Clock(NamedTuple):
    """Timing error of the ticks, estimated from the noise of a fit."""

    sigma: float  # s, standard deviation
    low: float  # s, 90 % interval
    high: float
    gain: float  # nats of evidence for a timing error above that of a usual clock

    @property
    def probability(self) -> float:
        """Probability of a timing error above that of a usual clock."""
        return float(expit(self.gain))


def clock(fit: Fitted, chance: float = CHANCE) -> Clock:
    """Timing error of the ticks by the residuals of a fit.

    A sensor counts where its innovations have at least a share `chance` of the power of its residual. The rivals are a
    usual clock, and a noise of each sensor that grows with the rate of this sensor alone.
    """
    dt = fit.like.sim.record.dt
    least = max(CLOCK[0] * dt, CLOCK[1])
    if MOST * dt <= least or fit.like.sim.mode != TRACK:
        return Clock(0.0, 0.0, 0.0, -np.inf)
    sizes = np.geomspace(least, MOST * dt, GRID)
    each = np.concatenate([_likely(part, own, sizes, chance) for part, own in fit.like.cut(fit.e)]) * fit.power
    likely = each.sum(axis=0)
    weight = np.exp((likely - likely.max()) * coarsened(fit.like.size, INNOVATIONS_OF_INTERVAL) / fit.power)
    total = np.cumsum(weight) / weight.sum()
    low, middle, high = (float(np.interp(q, total, sizes)) for q in (TAIL, 0.5, 1.0 - TAIL))
    own = float(np.sum(logsumexp(each, axis=1) - np.log(GRID))) - ODDS
    gain = float(logsumexp(likely) - np.log(GRID) - np.logaddexp(likely[0], own))
    return Clock(middle, low, high, gain)


def _likely(part: Likelihood, e: np.ndarray, sizes: np.ndarray, chance: float) -> np.ndarray:
    """Logarithm of the likelihood (positions, sizes) of residuals for timing errors of each of `sizes`, s.

    Inertia keeps the rate of a position steady from tick to tick; the rate of a force or a current does not show time.
    A residual that its past predicts is motion that the model lacks, and its growth with the rate is no timing error.
    """
    sensors = part.sim.case.machine.sensors
    out = [np.zeros((0, len(sizes)))]
    for c, name in enumerate(part.sim.channels):
        if name not in sensors or sensors[name].measures != "position":
            continue
        noise, own = part.noise[c], e[part.present[c], c]
        rest, grows = noise.filtered(own), part.growth[c][noise.order :]
        if np.mean(rest**2) <= chance * np.var(own):
            continue
        rate = grows[:, -1] / (part.mean * part.sim.record.dt) ** 2
        late = rate * float(noise.a @ noise.a) / part.mean
        each = [levels(rest, grows[:, :-1], float(part.least[c]), size**2 * late) for size in sizes]
        out.append(-np.array([[float(np.sum(surprise(rest / level, level))) for level in each]]))
    return np.concatenate(out)


def timed(fit: Fitted, found: Clock) -> Likelihood:
    """Likelihood of a fit with each command held for its actual time, averaged over PUSH ticks."""
    parts = [copy(part) for part in fit.like.parts]
    for part in parts:
        part.sim = _timed(part, fit.model, found.sigma)
    return parts[0] if len(parts) == 1 else Joint(parts)


def _timed(part: Likelihood, model: GraphModel, sigma: float) -> Simulator:
    """Simulator of one recording with each command held for its actual time; unchanged where a speed is followed."""
    sim = part.sim
    if sim.shows_speed:
        return sim
    other, dt = copy(sim), sim.record.dt
    y = sim.run(sim.own(model))[:, sim.layout.sensors[sim.main]]
    e, rate = sim.seen - y, np.gradient(y, dt)
    noise = float(np.min(part.noise[part.channels.index(sim.column(sim.main))].sigma)) * part.mean**0.5  # at rest
    late = (e - uniform_filter1d(e, SLOW)) * rate * sigma**2 / ((sigma * rate) ** 2 + noise**2)
    longer = np.append(np.diff(late), 0.0) / dt
    other.volts = np.ascontiguousarray(sim.volts + uniform_filter1d(sim.volts * longer[:, None], PUSH, axis=0))
    return other
