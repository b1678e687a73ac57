"""Noise of the sensors' residuals: autoregression, prediction by other sensors, and variance that grows with speed.

Counting makes no noise at rest. A late tick makes an error of the reading that is proportional to speed.

Source: Ljung, System Identification (1999), ch. 4; Kay, Modern Spectral Estimation (1988), ch. 7 for the covariance
method with both directions of time; Davidian & Carroll, Variance function estimation, JASA 82 (1987).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided, sliding_window_view
from scipy.linalg import solve_toeplitz
from scipy.optimize import nnls

SPAN = 10  # innovations before and after, of each earlier sensor, that predict one of a later sensor
OWN = 10  # past innovations of the sensor itself in this prediction
ROWS = 20  # innovations for each coefficient of a prediction, at least
VARIANCES = 5  # rounds of a variance function, at most, each weighed by the one before
SETTLED = 1e-3  # share of the least variance: largest change in the last round


class Noise(NamedTuple):
    """Noise of one sensor's residual: an autoregression, and a prediction by the innovations of earlier sensors."""

    a: np.ndarray  # (p + 1,) whitening filter, a[0] = 1
    sigma: float | np.ndarray  # standard deviation of the innovations: of all, or of each (n - p,)
    beside: tuple[np.ndarray, ...] = ()  # of each sensor before it: (2 SPAN + 1,) coefficients, the earliest first

    @property
    def order(self) -> int:
        """Number of past values."""
        return len(self.a) - 1

    def averaged(self) -> "Noise":
        """Noise with one standard deviation for all rows, for use on other rows."""
        return self._replace(sigma=float(np.sqrt(np.mean(np.square(self.sigma)))))

    def filtered(self, e: np.ndarray) -> np.ndarray:
        """Innovations (n - p, ...) of residuals (n, ...) by their past, in the unit of the residuals."""
        return filtered(self.a, e)

    def scaled(self, rest: np.ndarray) -> np.ndarray:
        """Innovations (n - p, ...) over their standard deviation."""
        return np.asarray((rest.T / self.sigma).T)


def noise_of(e: np.ndarray, order: int, least: float) -> Noise:
    """Autoregression of `order` of a residual (n,) about its mean; the innovation is not below `least`, rms.

    A constant is no noise: it stays in the innovations as the effect of a force.
    """
    n = len(e)
    e = e - e.mean()
    order = min(order, n // 20)
    r = np.array([e[lag:] @ e[: n - lag] for lag in range(order + 1)]) / n
    r[0] = r[0] * (1.0 + 1e-9) + 1e-300
    a = np.concatenate([[1.0], -solve_toeplitz(r[:-1], r[1:])]) if order else np.ones(1)
    innovation = filtered(a, e)
    return Noise(a, max(float(np.sqrt(np.mean(innovation**2))), least))


def surprise(white: np.ndarray, sigma: float | np.ndarray) -> np.ndarray:
    """Negative logarithm of the density (n,) of innovations with the standard deviation sigma, up to a constant.

    `white` (n,) are the innovations over their standard deviation.
    """
    return np.asarray(np.log(sigma) + 0.5 * white**2)


def levels(rest: np.ndarray, growth: np.ndarray, least: float, known: np.ndarray | float = 0.0) -> np.ndarray:
    """Standard deviation (n,) of innovations `rest` (n,), not below `least`.

    The variance is the sum of its `known` part (n,), a constant, and a share of each column of `growth` (n, columns),
    none of them negative. The square of a normal variable scatters in proportion to its mean: each square is weighed by
    the variance of the round before.
    """
    power = rest**2
    B = np.column_stack([np.ones(len(rest)), growth])
    B[:, 1:] /= np.maximum(B[:, 1:].mean(axis=0), 1e-300)
    variance = np.full(len(rest), max(float(power.mean()), least**2))
    for _ in range(VARIANCES):
        weighed = B / variance[:, None]
        H = weighed.T @ weighed
        H[np.diag_indices_from(H)] *= 1.0 + 1e-9
        L = np.linalg.cholesky(H)
        found, _ = nnls(L.T, np.linalg.solve(L, weighed.T @ ((power - known) / variance)))
        before, variance = variance, np.maximum(B @ found + known, least**2)
        if np.abs(variance - before).max() < SETTLED * before.min():
            break
    return np.sqrt(variance)


def noises_of(
    e: np.ndarray, present: Sequence[np.ndarray], order: int, least: np.ndarray, growth: Sequence[np.ndarray] = ()
) -> tuple[list[Noise], list[np.ndarray]]:
    """Noise of each sensor of residuals (n, sensors) in its rows `present`, and innovations as by `whitened`.

    `growth` (rows, columns) are the regressors of the variance of each sensor. A force without a law moves all sensors
    at once: the innovations of earlier sensors predict those of later ones. The determinant of the covariance is the
    product of the variances of the innovations.
    """
    out: list[Noise] = []
    white: list[np.ndarray] = []
    grids: list[np.ndarray | None] = []
    for c, rows in enumerate(present):
        own = noise_of(e[rows, c], order, float(least[c]))
        left, at = own.filtered(e[rows, c]), rows[own.order :]
        if any(grid is not None for grid in grids):
            own, left = joined(own, left, at, grids)
            at = rows[own.order :]
            own = own._replace(sigma=max(float(np.sqrt(np.mean(left**2))), float(least[c])))
        if growth and len(left) > ROWS * growth[c].shape[1]:
            own = own._replace(sigma=levels(left, growth[c][own.order :], float(least[c])))
        out.append(own)
        white.append(left / own.sigma)
        grids.append(gridded(left, at, len(e)) if len(rows) == len(e) else None)
    return out, white


def joined(
    own: Noise, rest: np.ndarray, at: np.ndarray, grids: Sequence[np.ndarray | None]
) -> tuple[Noise, np.ndarray]:
    """Noise of a sensor with a prediction by its past and by the innovations of earlier sensors, and its innovations.

    With too few rows, `own` and its innovations `rest`, in the rows `at`, are unchanged. Both predictions are fitted
    together: beside the innovations of other sensors, the past of a sensor has other coefficients.
    """
    past = min(OWN, own.order)
    columns = [neighbours(grid, at[past:]) for grid in grids if grid is not None]
    if len(at) - past <= ROWS * (past + (2 * SPAN + 1) * len(columns)):
        return own, rest
    if past:
        columns.append(sliding_window_view(rest, past)[:-1, ::-1])
    M = np.concatenate(columns, axis=1)
    A = M.T @ M
    A[np.diag_indices_from(A)] *= 1.0 + 1e-9
    A[np.diag_indices_from(A)] += 1e-300
    told = np.linalg.solve(A, M.T @ rest[past:])
    left = rest[past:] - M @ told
    beside, at_column = [], 0
    for grid in grids:
        width = 0 if grid is None else 2 * SPAN + 1
        beside.append(told[at_column : at_column + width] if width else np.zeros(2 * SPAN + 1))
        at_column += width
    a = np.convolve(own.a, np.concatenate([[1.0], -told[at_column:]]))
    return own._replace(a=a, beside=tuple(beside)), left


def whitened(noises: Sequence[Noise], e: np.ndarray, present: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Innovations of residuals (n, sensors, ...), by sensor, over their standard deviation."""
    out: list[np.ndarray] = []
    grids: list[np.ndarray | None] = []
    for c, (noise, rows) in enumerate(zip(noises, present, strict=True)):
        rest, at = noise.filtered(e[rows, c]), rows[noise.order :]
        for grid, told in zip(grids, noise.beside, strict=False):
            if grid is not None and told.any():
                rest = rest - filtered(told[::-1], grid)[at]
        needed = any(len(later.beside) > c and later.beside[c].any() for later in noises[c + 1 :])
        grids.append(gridded(rest, at, len(e)) if needed else None)
        out.append(noise.scaled(rest))
    return out


def filtered(a: np.ndarray, e: np.ndarray) -> np.ndarray:
    """Output (n - p, ...) of the finite impulse response filter a (p + 1,) over e (n, ...), in the precision of e: the
    sum over k of a[k] e[p - k + i], without the transient of the first p rows.

    Each block of p rows is one matrix product, about three times as fast as a convolution of each column.
    """
    p, n = len(a) - 1, max(len(e) - len(a) + 1, 0)
    rows = np.ascontiguousarray(e).reshape(len(e), math.prod(e.shape[1:]))
    block = max(p, 1)
    taps = np.zeros((block, block + p), rows.dtype)
    for i in range(block):
        taps[i, i : i + p + 1] = a[::-1]
    out = np.empty((n, rows.shape[1]), rows.dtype)
    whole = n // block
    step, own = rows.strides
    windows = as_strided(rows, (whole, block + p, rows.shape[1]), (block * step, step, own), writeable=False)
    np.matmul(taps, windows, out=out[: whole * block].reshape(whole, block, rows.shape[1]))
    rest = n - whole * block
    if rest:
        out[whole * block :] = taps[:rest, : rest + p] @ rows[whole * block :]
    return out.reshape(n, *e.shape[1:])


def gridded(rest: np.ndarray, at: np.ndarray, n: int) -> np.ndarray:
    """Innovations (n + 2 SPAN, ...) on all rows, 0 where there is none and beyond both ends."""
    out = np.zeros((n + 2 * SPAN, *rest.shape[1:]), rest.dtype)
    out[at + SPAN] = rest
    return out


def neighbours(grid: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Innovations (rows, 2 SPAN + 1, ...) around each of some rows."""
    if grid.ndim == 1 and len(at) and at[-1] - at[0] + 1 == len(at):  # consecutive rows
        return np.ascontiguousarray(sliding_window_view(grid, 2 * SPAN + 1)[at[0] : at[-1] + 1])
    return np.stack([grid[at + lag] for lag in range(2 * SPAN + 1)], axis=1)
