"""Fits a model to a recording by the error of a simulation that follows it, within what the owner's values may miss.

The unknowns are x: the logarithm of each plant parameter over the owner's value, and each term's parameter by its own
scale. Gauss-Newton with Levenberg damping inside bounds; a weak prior of the owner's tolerance keeps what the record
does not show where the owner put it.

Source: Nocedal & Wright, Numerical Optimization (2006), ch. 10; Ljung, System Identification (1999), ch. 7 for the
prediction error in closed loop.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from rtctl.diagnose.model import Model
from rtctl.diagnose.space import Space
from rtctl.diagnose.stretches import rms

TOLL = 0.08  # share of the cost that a further number of a term must take off
THREADS = 2
IDLE = 0.02  # rms error that a parameter moves over its whole tolerance: less needs no derivative of its own

Result = TypeVar("Result")


class Judge(Protocol):
    """What a fit asks of a recording: weighed errors of a model, and how many of them go together as one."""

    together: float

    def residual(self, model: Any, coarse: bool = False) -> np.ndarray:
        """Errors (rows,) of a model."""
        ...


class Fit(NamedTuple):
    """A model fitted to a record."""

    space: Space
    x: np.ndarray
    r: np.ndarray  # weighted error (rows,)
    J: np.ndarray  # (rows, unknowns), of r by x
    cost: float  # half the sum of squares and of the prior

    @property
    def model(self) -> Model:
        """The model itself."""
        return self.space.model(self.x)

    @property
    def rms(self) -> float:
        """Of the weighted error: 1 or less is all noise."""
        return rms(self.r)

    @property
    def merit(self) -> float:
        """Cost with a toll for each number of the terms: a further one must take off a share of what there is."""
        return self.cost * (1.0 + TOLL * sum(max(len(h.coordinates), 1) for h in self.space.hypotheses))

    def bound(self) -> list[str]:
        """Unknowns that ended at a bound."""
        low, high = self.space.bounds()
        near = np.minimum(self.x - low, high - self.x) < 1e-6
        return [name for name, is_near in zip(self.space.labels(), near, strict=True) if is_near]


def parallel(jobs: Sequence[Callable[[], Result]]) -> list[Result]:
    """Run simulations, or fits that consist of them, side by side: compiled code lets go of the interpreter."""
    if len(jobs) < 2:
        return [job() for job in jobs]
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(lambda job: job(), jobs))


def quotients(
    residual: Callable[[Any], np.ndarray],
    space: Space,
    x: np.ndarray,
    start: np.ndarray,
    columns: Sequence[int],
    gone: Callable[[np.ndarray], bool] = lambda e: False,
) -> list[np.ndarray]:
    """Difference quotients of a model's residual by the unknowns of some columns, each in the shape of the residual
    `start` at x. A step goes up, or down where up would pass the upper bound.

    A model may run away a step from where it does not, which `gone` tells by its residual: the step goes the other way
    then, and where it runs away there too, nothing is known of the column: it is 0.
    """
    high, steps = space.bounds()[1], space.steps()

    def column(i: int) -> np.ndarray:
        up = steps[i] if x[i] + steps[i] <= high[i] else -steps[i]
        for step in (up, -up):
            moved = x.copy()
            moved[i] += step
            e = residual(space.model(moved))
            if not gone(e):
                return np.asarray((e - start) / step)
        return np.zeros_like(start)

    return parallel([partial(column, i) for i in columns])


def jacobian(
    problem: Judge, space: Space, x: np.ndarray, columns: Sequence[int] | None = None, old: np.ndarray | None = None
) -> np.ndarray:
    """Forward differences (rows, columns) of the residual by x, away from the upper bound.

    `columns` are those asked for; with `old`, columns that hardly matter are taken from there.
    """
    wanted = list(range(len(x))) if columns is None else list(columns)
    if old is not None:
        moved = np.linalg.norm(old[:, : space.nb], axis=0) * space.reach()
        wanted = [i for i in wanted if i >= space.nb or moved[i] > IDLE * np.sqrt(len(old))]
    start = problem.residual(space.model(x), coarse=True)
    found = quotients(lambda model: problem.residual(model, coarse=True), space, x, start, wanted)
    if old is None:
        return np.stack(found, axis=1) if found else np.zeros((len(start), 0))
    J = old.copy()
    for i, values in zip(wanted, found, strict=True):
        J[:, i] = values
    return J


def fit(
    problem: Judge,
    space: Space,
    x: np.ndarray | None = None,
    rounds: int = 20,
    enough: float = 2e-3,
    J: np.ndarray | None = None,
    rough: bool = False,
    give_up: Callable[[float], bool] | None = None,
) -> Fit:
    """Least squares from `x`.

    Between full Jacobians the last one is kept up to date by Broyden's formula, which costs nothing; a guess `J` saves
    the first. Stops when a round gains less than `enough` of the cost with a fresh Jacobian (`rough`: with any, in
    coarse simulations), or where `give_up(cost)` says so. Source: Broyden, Math. Comp. 19 (1965).
    """
    low, high = space.bounds()
    x = np.clip(space.start() if x is None else np.array(x, float), low, high)
    r = problem.residual(space.model(x), rough)
    weight = space.prior() * trust(r, problem.together)

    def total(r: np.ndarray, x: np.ndarray) -> float:
        return 0.5 * float(r @ r) + 0.5 * float(weight @ x**2)

    cost = total(r, x)
    damping, fresh = 1e-4, J is None
    J = jacobian(problem, space, x) if J is None else J
    for _ in range(rounds):
        g = J.T @ r + weight * x
        H = J.T @ J + np.diag(weight)
        gained = False
        for _ in range(12 if fresh else 3):
            dx = bounded_step(H, g, x, low, high, damping)
            if not np.abs(dx).max(initial=0.0) > 1e-9:
                break
            trial = problem.residual(space.model(x + dx), rough)
            new = total(trial, x + dx)
            if new < cost:
                gained = True
                break
            damping *= 10
        if not gained:
            if fresh or rough:
                break
            J, fresh, damping = jacobian(problem, space, x, old=J), True, 1e-4
            continue
        share = (cost - new) / max(cost, 1e-30)
        hoped = -(g @ dx + 0.5 * dx @ H @ dx)
        honest = (cost - new) > 0.3 * hoped
        if honest:
            J = J + np.outer(trial - r - J @ dx, dx) / float(dx @ dx)
        x, r, damping = x + dx, trial, max(damping / 10, 1e-8)
        weight = space.prior() * trust(r, problem.together)
        cost = total(r, x)
        if give_up is not None and give_up(cost):
            break
        if share < enough and (fresh or rough):
            break
        if not honest or share < enough:
            J, fresh = jacobian(problem, space, x, old=J), True
        else:
            fresh = False
    if rough:
        r = problem.residual(space.model(x))
        weight = space.prior() * trust(r, problem.together)
        cost = total(r, x)
    return Fit(space, x, r, J, cost)


def trust(r: np.ndarray, together: float = 1.0) -> float:
    """By how much the owner's values outweigh the errors' count, of which `together` count as one.

    Errors of neighbouring ticks go together, and where the model lacks something they are no noise at all. Without this
    weight, parameters that hardly matter run into their bounds to serve what is missing, and the way back is barred.
    """
    return together * max(1.0, float(np.mean(r**2)))


def bounded_step(
    H: np.ndarray, g: np.ndarray, x: np.ndarray, low: np.ndarray, high: np.ndarray, damping: float
) -> np.ndarray:
    """Minimum of g dx + dx H dx / 2 with relative `damping` inside the bounds, by an active set.

    Source: Stark & Parker, Bounded-variable least squares, Computational Statistics 10 (1995).
    """
    d = np.sqrt(np.maximum(np.diag(H), 1e-12))
    A = H / np.outer(d, d)
    A[np.diag_indices_from(A)] += damping + 1e-10
    b, lo, hi = -g / d, (low - x) * d, (high - x) * d
    z = np.clip(np.linalg.solve(A, b), lo, hi)
    state = np.where(z <= lo, -1, np.where(z >= hi, 1, 0))
    for _ in range(4 * len(x)):
        free = state == 0
        if free.any():
            rest = b[free] - A[np.ix_(free, ~free)] @ z[~free]
            want = np.linalg.solve(A[np.ix_(free, free)], rest)
            move = want - z[free]
            with np.errstate(divide="ignore", invalid="ignore"):
                room = np.where(
                    move > 0, (hi[free] - z[free]) / move, np.where(move < 0, (lo[free] - z[free]) / move, 1.0)
                )
            room = np.where(np.isfinite(room), room, 1.0)
            step = min(1.0, float(room.min()))
            z[free] += step * move
            if step < 1.0:
                hit = np.flatnonzero(free)[int(np.argmin(room))]
                state[hit] = 1 if move[int(np.argmin(room))] > 0 else -1
                z[hit] = hi[hit] if state[hit] > 0 else lo[hit]
                continue
        slope = A @ z - b
        wrong = ((state == -1) & (slope < -1e-12)) | ((state == 1) & (slope > 1e-12))
        if not wrong.any():
            break
        state[int(np.argmax(np.where(wrong, np.abs(slope), -1.0)))] = 0
    return np.clip(z / d, low - x, high - x)
