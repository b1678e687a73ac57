"""Prediction of rows that no fit saw: a free run, the loop closed by the machine's own law where it is known.

A fit on track judges each error where it arises and cares little for those that only add up over seconds. Where it is
all noise, nothing better can be had. Where something is left over that has no name, the parameters that follow the
track best are not those that run best on their own, and what a model is for decides: `free_fit` asks for both.

Source: Janot, Gautier & Brunot (2019) and Champneys, Beintema, Toth, Schoukens & Rogers (2024) for the free run under
the recorded command as the measure of a model; Ljung, System Identification (1999), 3.3, for long predictions.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rtctl.diagnose.decide import better
from rtctl.diagnose.edges import Edges
from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.kernel import CLOSED, OPEN, TRACK
from rtctl.diagnose.measure import begin, free_run
from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import EDGE, Problem
from rtctl.diagnose.record import Record
from rtctl.diagnose.release import band, let_go
from rtctl.diagnose.rework import enrich
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.stretches import rms

TRIES = 4  # weights of the two errors, by what the last fit left of each
NONE = 1e-12  # an rms to divide by is never quite 0
NO_GAP = 0.1  # of what is left
QUARTERS = 4
WORSE = 1.5  # times the rms on track: a free run is not bought at any price


def mode_of(record: Record) -> int:
    """Closed loop where the law is known; else open loop where the machine itself is stable, else on track."""
    if record.closed_loop:
        return CLOSED
    return OPEN if record.case.controller.kind == "none" else TRACK


def nrmse(sim: Simulator, model: Model, rows: slice, edges: Sequence[Edges] = (), mode: int | None = None) -> float:
    """Error of the free run over `rows`, or of a run in `mode`, by the spread of the whole recording; rms over the main
    sensor and the reels whose edges are known. In open loop the run begins at the state that the record shows there."""
    out = readings(sim, model, rows, mode_of(sim.record) if mode is None else mode, bool(edges))
    if not np.isfinite(out).all():
        return 1e3
    n = len(out)
    shares = [rms((sim.seen - out[:, 0])[rows]) / spread(sim.seen)]
    for reel in edges:
        e = reel.error(out) * reel.sigma  # the constant is of the whole record
        late = (reel.rows >= (rows.start or 0)) & (reel.rows < (rows.stop or n))
        if late.any():
            shares.append(rms(e[late]) / spread(reel.at))
    return min(rms(np.array(shares)), 1e3)


def readings(sim: Simulator, model: Model, rows: slice, mode: int, directed: bool = False) -> np.ndarray:
    """Readings (n, sensors) of a run in `mode` that predicts `rows`; in open loop the model is on track before them."""
    if mode == OPEN:
        return let_go(sim, model, rows.start or 0).run(model, TRACK, directed=directed)
    return sim.run(model, mode, directed=directed)


def floor(problem: Problem) -> float:
    """The same of noise alone."""
    shares = [problem.main_floor * float(problem.sigma[0]) / spread(problem.sim.seen)]
    shares += [EDGE * rms(reel.sigma) / spread(reel.at) for reel in problem.edges]
    return rms(np.array(shares))


def uncertain(problem: Problem, fitted: Fit, rows: slice, forces: bool) -> float:
    """The same that a free run in open loop has by noise, by the uncertainty of the model and of its first state, and
    with `forces` by random forces."""
    return band(problem, fitted, rows, forces) / spread(problem.sim.seen)


def spread(y: np.ndarray) -> float:
    """Standard deviation, never 0."""
    return float(np.std(y)) or 1.0


def closed_on_track(problem: Problem, before: Fit, after: Fit, unseen: np.ndarray) -> float:
    """Share of the gap to the noise that `after`, not fitted on the errors `unseen` (errors,), closes there, on track.

    The noise is what `after` leaves of the rows that it was fitted on: where forces are random, a free run adds them up
    and tells nothing. Nan where `before` leaves no gap.
    """
    old, new = problem.residual(before.model), problem.residual(after.model)
    gap = rms(old[unseen]) ** 2 - rms(new[~unseen]) ** 2
    if gap < NO_GAP * rms(new[~unseen]) ** 2:
        return float("nan")
    return (rms(old[unseen]) ** 2 - rms(new[unseen]) ** 2) / gap


def repeated(problem: Problem, before: Fit, after: Fit) -> float:
    """Share of the gain of `after` over `before` on fitted errors that rows which no fit saw show as well, under the
    tracking observer, quarter by quarter. 0 without a gain."""
    gained = float(before.r @ before.r - after.r @ after.r)
    if gained <= 0.0:
        return 0.0
    predicted = 0.0
    for rows, *models in without_quarters(problem, before, after):
        unseen = (problem.time_rows >= rows.start) & (problem.time_rows < rows.stop)
        old, new = (problem.residual(model)[unseen] for model in models)
        predicted += float(old @ old - new @ new)
    return predicted / gained


def runs_better(problem: Problem, before: Fit, after: Fit) -> int:
    """Number of quarters that a free run of `after` from the recorded state predicts better than one of `before`, each
    fitted to the other quarters."""
    count = 0
    for rows, *models in without_quarters(problem, before, after):
        old, new = (nrmse(problem.sim, model, rows, problem.edges, OPEN) for model in models)
        count += new < old
    return count


def without_quarters(problem: Problem, *fits: Fit) -> Iterator[tuple[Any, ...]]:
    """Rows of each quarter of the record, and the models of `fits` fitted to the other three."""
    length = len(problem.sim.seen) // QUARTERS
    for quarter in range(QUARTERS):
        rows = slice(quarter * length, (quarter + 1) * length)
        seen = (problem.time_rows < rows.start) | (problem.time_rows >= rows.stop)
        rest = problem.weighed(seen.astype(float))
        yield rows, *(fit(rest, f.space, f.x, rounds=5).model for f in fits)


def elsewhere(sim: Simulator, rows: np.ndarray) -> float:
    """Share of the `rows` (n,) at which the machine is where it was in none of the others."""
    rest = sim.seen[~rows]
    return float(np.mean((sim.seen[rows] < rest.min()) | (sim.seen[rows] > rest.max())))


def closed_within(problem: Problem, before: Fit, after: Fit) -> float:
    """As `closed_on_track`, of that quarter of the record which lies best within the way of all the rest."""
    n = len(problem.sim.seen)
    quarter = np.arange(n) // (n // QUARTERS)
    inner = min(range(QUARTERS), key=lambda k: elsewhere(problem.sim, quarter == k))
    unseen = (quarter == inner)[problem.time_rows]
    rest = problem.weighed((~unseen).astype(float))
    old, new = (fit(rest, f.space, f.x, rounds=5) for f in (before, after))
    return closed_on_track(problem, old, new, unseen)


def holds_in_white(white: Problem, before: Fit, after: Fit, cut: int) -> bool:
    """Whether `after`, fitted on rows before `cut`, does better than `before` beyond them, in white errors."""
    late = white.time_rows >= cut
    old, new = (white.residual(f.model)[late] for f in (before, after))
    return float(new @ new) < float(old @ old)


def early(problem: Problem, before: Fit, after: Fit, cut: int) -> bool:
    """Whether what tells `after` from `before` acts before row `cut`, and beyond it is less than what `after` leaves.

    As a limit that is reached in two moments: a free run beyond tells of all else and next to nothing of it.
    """
    late = problem.time_rows >= cut
    new = problem.residual(after.model)
    apart = problem.residual(before.model) - new
    return rms(apart[late]) < rms(new[late]) and rms(apart[~late]) > rms(new[~late])


def refit(sim: Simulator, problem: Problem, fitted: Fit, stop: int) -> Fit:
    """The same model fitted anew on the rows before `stop` alone."""
    first = Problem(sim, stop, problem.channels, problem.mean, problem.edges)
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

    def residual(self, model: Model, coarse: bool = False, at: str = "") -> np.ndarray:
        """Both as one row of numbers."""
        near, far = super().residual(model, coarse, at) / self.near, self.drift(model, coarse) / self.far
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
