"""Steps of a fit by least squares: difference quotients, damped Gauss-Newton inside bounds, parallel simulations.

Source: Nocedal & Wright, Numerical Optimization (2006), ch. 10.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import ContextVar
from functools import partial
from typing import Any, TypeVar

import numpy as np

from rtctl.diagnose.model.space import Space

# Threads of one process. A caller with several processes sets 1: a context variable limits no other caller of this
# process.
THREADS: ContextVar[int] = ContextVar("threads", default=2)

Result = TypeVar("Result")


def parallel(jobs: Sequence[Callable[[], Result]]) -> list[Result]:
    """Results of simulations, or of fits, that run in several threads: compiled code releases the interpreter lock."""
    threads = THREADS.get()
    if len(jobs) < 2 or threads < 2:
        return [job() for job in jobs]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(lambda job: job(), jobs))


def quotients(
    residual: Callable[[Any], np.ndarray],
    space: Space,
    x: np.ndarray,
    start: np.ndarray,
    columns: Sequence[int],
    gone: Callable[[np.ndarray], bool],
) -> list[np.ndarray]:
    """Difference quotients of a residual by the unknowns of some columns, each in the shape of `start`, its value at x.

    A step goes up, or down where up would pass the upper bound. Where the model diverges after a step, as `gone`
    decides by its residual, the step is reversed. Where the model diverges after both steps, the column is 0.
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


def trust(r: np.ndarray, together: float = 1.0) -> float:
    """Weight of the prior: the mean square of the residuals, at least 1, times `together` correlated residuals.

    Residuals of neighbouring ticks are correlated, and residuals of an incomplete model are no noise. Without this
    weight, parameters of little influence move to their bounds to fit missing effects, and do not return.
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
