"""Ticks off their times: an error that no model of motion predicts, but whose size grows with speed.

A tick that comes d late shows a reading v d further on. The d are independent, so that the error's second difference,
which what is smooth hardly touches, has the variance 3/2 (s^2 + (v sigma)^2) and forgets after two ticks.

Cutting into counts makes noise that depends on speed as well: at one count a tick every reading is cut alike and the
differences show nothing, at one and a half each other one is cut the other way. `cut` is what that amounts to, of which
a reading with noise of its own shows a part; what is left of the growth with speed is the ticks'.

They move the machine, too: a command acts until the next one is written, and a law with a derivative answers a late
reading, which is v d ahead, with a command against the motion that is then cut short. On average that is a force along
the motion, by the square of sigma. `pushed` reads each d back from the error and gives the model that force.

Source: Cervin et al., How does control timing affect performance, IEEE Control Systems 23(3) (2003); Box, Jenkins &
Reinsel, Time series analysis (2008), ch. 3 for the correlation of a differenced white series; Widrow & Kollar,
Quantization noise (2008), for that of readings that are cut.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import lsq_linear
from scipy.stats import norm

from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem, main_channels, means
from rtctl.diagnose.simulate import Simulator, resolution

FAST = 0.7  # counts a tick: slower, the cut into counts is no white noise
ENOUGH = 400  # rows that fast
LEAST, CLOCK = 0.025, 4e-6  # of a tick, and s: less is what any clock does
LOUD = 0.15  # of the variance at the usual speed, what jitter must add
CERTAIN = 8.0  # standard errors
LOUDER = 1.5  # times the noise that is left: a late tick also holds the last command for longer
SMOOTH, PUSH = 21, 41  # ticks: what changes more slowly is no late tick; over which the force is averaged
TINY = 1e-30  # beside a power that may be 0
AGREES = 0.25  # of sigma squared: what another sensor must bear out
MIXED = (-0.82, -0.5)  # correlation of neighbouring second differences: -2/3 where the ticks are independent


class Jitter(NamedTuple):
    """Standard deviation of the ticks' times and its standard error, s."""

    sigma: float
    error: float
    noise: float = 0.0  # standard deviation of the reading besides, in its unit
    dt: float = 0.0  # s, a tick

    @property
    def told(self) -> bool:
        """Whether it is more than what any clock does, which makes noise but is no fault."""
        return self.sigma >= max(LEAST * self.dt, CLOCK)


def jitter(sim: Simulator, model: Model, rows: slice) -> Jitter | None:
    """Of the main sensor's error under `model`; None where there is no sign of it, or another sensor that is read at
    the same ticks shows none: near one count a tick the cut into counts alone may look like it."""
    out = sim.run(model)
    main, *others = main_channels(sim)
    found = of_sensor(sim, out, main, rows)
    if found is None:
        return None
    for c in others:
        grown = grows(sim, out, c, rows)
        if grown is not None and grown[0] < AGREES * found.sigma**2:
            return None
    return found


def of_sensor(sim: Simulator, out: np.ndarray, channel: int, rows: slice) -> Jitter | None:
    """Of the error of one sensor, beside what is simulated of all, `out` (n, sensors)."""
    found = grows(sim, out, channel, rows)
    if found is None:
        return None
    slope, error, floor, d, v = found
    if slope < CERTAIN * error or slope * np.mean(v**2) < LOUD * floor:
        return None
    z = d / np.sqrt(floor + slope * v**2)
    mixed = float(z[1:] @ z[:-1]) / float(z @ z)
    if not MIXED[0] < mixed < MIXED[1]:
        return None
    sigma = float(np.sqrt(slope))
    return Jitter(sigma, 0.5 * error / sigma, float(np.sqrt(floor)), sim.record.dt)


def grows(
    sim: Simulator, out: np.ndarray, channel: int, rows: slice
) -> tuple[float, float, float, np.ndarray, np.ndarray] | None:
    """How the power of a sensor's second differences grows with the square of speed, as in `growth`, and both (ticks,)
    themselves; None where it moves too slowly to tell."""
    record = sim.record
    seen = sim.seen if channel == 0 else record.y[sim.channels[channel]]
    e = (seen - out[:, channel])[rows]
    v = np.gradient(out[:, channel], record.dt)[rows][1:-1]
    d = e[1:-1] - 0.5 * (e[:-2] + e[2:])
    count = 1.0 if record.plant != "axis" else resolution(record)
    fast = np.abs(v) * record.dt > FAST * count
    if not np.isfinite(e).all() or fast.sum() < ENOUGH:
        return None
    d, v = d[fast], v[fast]
    beyond = np.abs(d) > 8 * np.median(np.abs(d)) + count  # lost counts
    d, v = d[~beyond], v[~beyond]
    return (*growth(d**2 / 1.5, v**2, count**2 * cut(v * record.dt / count)), d, v)


def cut(v: np.ndarray) -> np.ndarray:
    """Power (n,) of the noise that cutting into counts makes in second differences at v (n,) counts a tick, as that of
    independent readings would be told by them, count^2."""

    def alike(step: np.ndarray) -> np.ndarray:  # covariance of what two readings so far apart are cut by
        off = np.mod(step, 1.0)
        return 1.0 / 12.0 - 0.5 * off * (1.0 - off)

    return (1.5 / 12.0 + 0.5 * alike(2.0 * v) - 2.0 * alike(v)) / 1.5


def growth(power: np.ndarray, x: np.ndarray, other: np.ndarray) -> tuple[float, float, float]:
    """Slope of `power` (n,) over x (n,), its standard error and what is left besides on average, of which a share of
    `other` (n,) may be.

    A power of noise scatters by its own mean, so that rows are weighed by the fit of the round before.
    """
    A = np.stack([np.ones_like(x), x, other], axis=1)
    mean = np.full(len(x), power.mean())
    for _ in range(4):
        weighed = A / mean[:, None]
        scale = np.linalg.norm(weighed, axis=0) + TINY
        found = lsq_linear(weighed / scale, power / mean, ([0.0, -np.inf, 0.0], [np.inf, np.inf, scale[2]]))
        each = found.x / scale
        mean = np.maximum(A @ each, 0.05 * power.mean())
    scatter = float(np.mean(((power - mean) / mean) ** 2))  # 2 for independent ones; neighbours share ticks
    H = weighed.T @ weighed + np.diag(TINY + 1e-12 * scale**2)
    error = float(np.sqrt(2.0 * scatter * np.linalg.inv(H)[1, 1]))
    return float(each[1]), error, float(each[0] + each[2] * other.mean())


def allowed_for(problem: Problem, model: Model, found: Jitter) -> Problem:
    """The problem with errors weighed by what a jitter lets one expect of each."""
    out = problem.sim.run(model)[:, problem.channels]
    v = np.gradient(out, problem.sim.record.dt, axis=0)[problem.rows]
    spread = means((v * found.sigma / problem.sigma) ** 2, problem.mean) / problem.mean
    allowing = problem.allowing(1.0 / np.sqrt(1.0 + problem.beside(spread.T.ravel())))
    allowing.louder = LOUDER if found.told else 1.0
    return allowing


def pushed(sim: Simulator, model: Model, found: Jitter) -> Simulator:
    """The simulator whose commands allow for how long each of them was held, on average over PUSH ticks."""
    out = sim.run(model)[:, 0]
    e, v = sim.seen - out, np.gradient(out, sim.record.dt)
    power = (found.sigma * v) ** 2
    late = (e - uniform_filter1d(e, SMOOTH)) * v * found.sigma**2 / (power + found.noise**2 + TINY)
    longer = np.append(np.diff(late), 0.0) / sim.record.dt
    return sim.commanded(sim.volts + uniform_filter1d(sim.volts * longer[:, None], PUSH, axis=0))


def interval(found: Jitter) -> tuple[float, float]:
    """90 % interval of sigma, s."""
    half = float(norm.ppf(0.95)) * found.error
    return max(found.sigma - half, 0.0), found.sigma + half
