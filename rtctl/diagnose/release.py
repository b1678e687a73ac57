"""Free run from the recorded state, and the error that noise alone gives it.

A model follows the recording under the tracking observer up to a row shortly before the rows that are predicted. There
it is let go with all states of the observer; position and speed are fitted to the readings between the release and the
first predicted row. The error of a right model grows from there by its parameters' and its first state's uncertainty,
and by random forces; of an integrating plant without bound. `band` is the size of the error by these.

Source: Ljung, System Identification (1999), 3.3 for simulation and 9.4 for the variance of a model.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from rtctl.diagnose.fit import Fit, parallel
from rtctl.diagnose.kernel import TRACK
from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import FORGET, Problem
from rtctl.diagnose.simulate import SHARE, Simulator, per_unit, resolution
from rtctl.diagnose.stretches import rms
from rtctl.diagnose.uncertainty import covariance

FEWEST = 20  # rows that the first state is fitted to
ROUNDS = 3  # of that fit, which is all but linear
STEP = 0.5  # standard deviations, of the difference quotients
PLACES = 3  # stretches of the recording whose random forces are tried on the predicted rows


def stretch(sim: Simulator, row: int) -> slice:
    """Rows that the state at the release is fitted to: those before `row` in which the observer forgets its past; the
    first rows where there are none."""
    count = max(FEWEST, round(FORGET / (sim.follow * sim.record.dt)))
    return slice(row - count, row) if row >= 2 * count else slice(0, min(count, len(sim.seen)))


def let_go(sim: Simulator, model: Model, row: int) -> Simulator:
    """The simulator whose tracking runs of `model` are free from shortly before `row`, from the state that the record
    shows there: a Gauss-Newton fit of position and speed. As the observer has it where the model runs away."""
    rows = stretch(sim, row)
    begin, end = rows.start, rows.stop
    seconds = (end - begin) * sim.record.dt
    size = max(float(np.ptp(sim.seen[rows])), resolution(sim.record) * per_reading(sim)) / per_reading(sim)
    steps = size * np.array([seconds, 1.0] if sim.record.shows_speed else [1.0, 1.0 / seconds])

    def error(jolt: np.ndarray) -> np.ndarray:
        return sim.seen[rows] - sim.released(begin, jolt).run(model, TRACK, end)[rows, 0]

    jolt = np.zeros(2)
    for _ in range(ROUNDS):
        e = error(jolt)
        J = np.stack([error(jolt + step) - e for step in np.diag(steps)], axis=1)
        if not np.isfinite(J).all():
            return sim.released(begin)
        jolt = jolt - steps * np.linalg.lstsq(J, e, rcond=None)[0]
    better = rms(np.nan_to_num(error(jolt), nan=np.inf)) <= rms(error(np.zeros(2)))
    return sim.released(begin, jolt if better else None)


def per_reading(sim: Simulator) -> float:
    """Units of the main sensor's reading for a rad or m."""
    return float(per_unit(sim.case)[0])


def band(problem: Problem, fitted: Fit, rows: slice, forces: bool) -> float:
    """Rms error of the main sensor, in its unit, that a free run of a right model has over `rows`: from noise, the
    covariance of the parameters and of the first state, and with `forces` from random forces."""
    free = let_go(problem.sim, fitted.model, rows.start or 0)
    usual = free.run(fitted.model)[rows, 0]
    if not np.isfinite(usual).all():
        return 0.0
    noise = problem.main_floor * float(problem.sigma[0])
    columns = [np.full(len(usual), noise), *by_parameters(problem, fitted, free, rows, usual)]
    columns += by_state(problem, fitted, free, rows, usual, noise)
    if forces:
        columns.append(np.full(len(usual), by_forces(problem, fitted, free, rows, usual)))
    return float(np.sqrt(sum(np.mean(np.nan_to_num(c, nan=0.0) ** 2) for c in columns)))


def by_parameters(problem: Problem, fitted: Fit, free: Simulator, rows: slice, usual: np.ndarray) -> list[np.ndarray]:
    """Change of the free run (rows,) by each principal direction of the parameters' covariance, one standard deviation
    each."""
    if not len(fitted.x):
        return []
    values, vectors = np.linalg.eigh(covariance(fitted, problem.block))
    low, high = fitted.space.bounds()

    def change(step: np.ndarray) -> np.ndarray:
        x = np.clip(fitted.x + STEP * step, low, high)
        return np.asarray((free.run(fitted.space.model(x))[rows, 0] - usual) / STEP)

    jobs: list[Callable[[], np.ndarray]] = [
        partial(change, vectors[:, i] * np.sqrt(values[i])) for i in range(len(values)) if values[i] > 0.0
    ]
    return parallel(jobs)


def by_state(
    problem: Problem, fitted: Fit, free: Simulator, rows: slice, usual: np.ndarray, noise: float
) -> list[np.ndarray]:
    """The same by position and speed at the release, as sure as the noise of the readings lets them be."""
    first = stretch(problem.sim, rows.start or 0)
    count, unit = first.stop - first.start, per_reading(problem.sim)
    seconds = count * problem.sim.record.dt
    # straight line through `count` readings: its value at the begin and its slope
    off = np.array([2.0, 3.5 / seconds]) * noise / unit / np.sqrt(count)
    if problem.sim.record.shows_speed:
        off = np.array([0.0, noise / unit / np.sqrt(count)])
    out = []
    for step in np.diag(off):
        moved = problem.sim.released(free.release, free.jolt + step)
        out.append(moved.run(fitted.model)[rows, 0] - usual)
    return out


def by_forces(problem: Problem, fitted: Fit, free: Simulator, rows: slice, usual: np.ndarray) -> float:
    """Rms change of the free run, in the sensor's unit, by the forces that the observer needed in other rows to keep
    the model on track: median over stretches of the recording. What they are in the mean of all is no random force."""
    sim = problem.sim
    push = sim.everything(fitted.model, TRACK)[2]
    begin = rows.start or 0
    count = len(usual)
    first = problem.rows.start or 0
    usually = push[first:begin].mean() if begin > first else 0.0
    starts = np.linspace(first, max(begin - count, first), PLACES).astype(int)
    gain = sim.case.drive.amp_per_volt[0] if sim.record.plant == "ldu" else 1.0
    sizes = []
    for start in starts:
        extra = np.zeros(len(sim.seen))
        there = push[start : start + count]
        extra[begin : begin + len(there)] = there - usually
        other = free.commanded(free.volts + np.outer(extra, np.array(SHARE[sim.record.plant]) / gain))
        sizes.append(rms(np.nan_to_num(other.run(fitted.model)[rows, 0] - usual)))
    return float(np.median(sizes))
