"""Prediction of rows that no fit saw: a free run, the loop closed by the machine's own law where it is known.

A fit on track judges each error where it arises and cares little for those that only add up over seconds. Where it is
all noise, nothing better can be had. Where something is left over that has no name, the parameters that follow the
track best are not those that run best on their own, and what a model is for decides: `free_fit` asks for both.

Source: Janot, Gautier & Brunot (2019) and Champneys, Beintema, Toth, Schoukens & Rogers (2024) for the free run under
the recorded command as the measure of a model; Ljung, System Identification (1999), 3.3, for long predictions.
"""

import numpy as np

from rtctl.diagnose.decide import better
from rtctl.diagnose.fit import Fit, Problem, fit
from rtctl.diagnose.kernel import CLOSED, OPEN, TRACK
from rtctl.diagnose.measure import begin, free_run
from rtctl.diagnose.model import Model
from rtctl.diagnose.name import enrich
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.stretches import rms

TRIES = 4  # weights of the two errors, by what the last fit left of each
NONE = 1e-12  # an rms to divide by is never quite 0
WORSE = 1.5  # times the rms on track: a free run is not bought at any price


def mode_of(record: Record) -> int:
    """Closed loop where the law is known; else open loop where the machine itself is stable, else on track."""
    if record.closed_loop:
        return CLOSED
    return OPEN if record.case.controller.kind == "none" else TRACK


def nrmse(sim: Simulator, model: Model, rows: slice) -> float:
    """Error of the free run's main sensor over `rows`, by the spread of the whole recording."""
    y = sim.seen
    out = sim.run(model, mode_of(sim.record))[:, 0]
    error = (y - out)[rows]
    if not np.isfinite(error).all():
        return 1e3
    spread = float(np.std(y)) or 1.0
    return min(float(np.sqrt(np.mean(error**2))) / spread, 1e3)


def refit(sim: Simulator, problem: Problem, fitted: Fit, stop: int) -> Fit:
    """The same model fitted anew on the rows before `stop` alone."""
    first = Problem(sim, stop=stop, channels=problem.channels, mean=problem.mean)
    return fit(first, fitted.space, fitted.x, rounds=5)


class FreeRun(Problem):
    """The error on track beside that of the free run under the recorded command, each by its own rms."""

    def __init__(self, sim: Simulator, model: Model, stop: int | None = None):
        super().__init__(sim, stop=stop)
        self.weigh(model)

    @property
    def floor(self) -> float:
        """None: of a free run nobody knows what noise leaves."""
        return 0.0

    def weigh(self, model: Model) -> None:
        """Make both errors of `model` count alike, and begin the free run as it wants to."""
        self.start = begin(self.sim, model)
        self.near, self.far = (max(rms(x), NONE) for x in (super().residual(model), self.drift(model)))

    def drift(self, model: Model, coarse: bool = False) -> np.ndarray:
        """Error of the free run (rows,), in the sensor's unit."""
        out = free_run(self.sim, model, self.start, self.n, coarse)[self.rows, 0]
        return np.nan_to_num(self.sim.seen[: self.n][self.rows] - out, nan=1e6).clip(-1e6, 1e6)

    def residual(self, model: Model, coarse: bool = False) -> np.ndarray:
        """Both as one row of numbers."""
        near, far = super().residual(model, coarse) / self.near, self.drift(model, coarse) / self.far
        return np.concatenate((near, far * np.sqrt(len(near) / len(far))))


def free_fit(sim: Simulator, fitted: Fit) -> Fit:
    """A fit on track, moved to where the machine runs best on its own as well; as it is where that cannot be had.

    A term that earns its richer form in the free run gets it. Only for an axis whose record is free of drift: of the
    other machines the loop is part of what a model is for.
    """
    if sim.record.plant != "axis" or mode_of(sim.record) == TRACK:
        return fitted
    problem = FreeRun(sim, fitted.model)
    track = problem.near
    moved = fit(problem, fitted.space, fitted.x, rounds=10)
    moved = enrich(problem, moved, better)
    for _ in range(TRIES):
        problem.weigh(moved.model)
        moved = fit(problem, moved.space, moved.x, rounds=10, enough=1e-3)
    problem.weigh(moved.model)
    return moved if problem.near < WORSE * track else fitted
