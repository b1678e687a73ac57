"""Prediction of rows that no fit saw: a free run, the loop closed by the machine's own law where it is known."""

import numpy as np

from rtctl.diagnose.fit import Fit, Problem, fit
from rtctl.diagnose.kernel import CLOSED, OPEN, TRACK
from rtctl.diagnose.model import Model
from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import Simulator


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
