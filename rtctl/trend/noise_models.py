"""Scatter of estimates over recordings: models of their correlation, by which a series is whitened.

The covariance of a series is sigma^2 V. V is a mixture of the variances of the estimates (independent, from their
intervals) and of a variation between recordings (an autoregression of first order). sigma is unknown; it is
integrated out.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

SHARES = {0.0: 0.4, 0.5: 0.3, 1.0: 0.3}  # share of the variance between recordings: prior probability
PHIS = {0.0: 0.5, 0.5: 0.25, 0.8: 0.15, 0.95: 0.1}  # correlation of neighbouring recordings: prior probability
STRAY, AROUND = 5.0, 7  # outlier: least deviation, in scatters, from the median of AROUND neighbours


class Whitened(NamedTuple):
    """A series and its possible changes, whitened under one noise model."""

    y: np.ndarray  # (n,)
    ones: np.ndarray  # (n,)
    line: np.ndarray  # (n,) a drift, -1/2 to 1/2
    steps: np.ndarray  # (n, n - 1) a shift before record 1, 2, ...
    volume: float  # log of its prior probability less half the log determinant of V


def whitened(y: np.ndarray, s: np.ndarray, at: np.ndarray) -> list[Whitened]:
    """The series y (n,) with standard deviations s (n,) at places `at` (n,) under every noise model."""
    n = len(y)
    scale = np.exp(np.mean(np.log(s**2)))
    own, stray = s**2 / scale, strays(y) ** 2
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    line = (at - at[0]) / (at[-1] - at[0]) - 0.5
    out = []
    for share, known in SHARES.items():
        for phi, likely in (PHIS if share else {0.0: 1.0}).items():
            V = share * phi**lags + np.diag((1.0 - share) * own + stray)
            L = np.linalg.cholesky(V + 1e-9 * np.eye(n))
            W = solve_triangular(L, np.eye(n), lower=True)
            later = np.cumsum(W[:, ::-1], axis=1)[:, ::-1]  # column k: 1 from record k on
            volume = float(np.log(known * likely) - np.sum(np.log(np.diag(L))))
            out.append(Whitened(W @ y, later[:, 0], W @ line, later[:, 1:], volume))
    return out


def strays(y: np.ndarray) -> np.ndarray:
    """Deviation of each record (n,) from the median of its neighbours on both sides, in scatters; 0 for no outlier.

    A record at a shift is no outlier: half of its neighbours are at its level.
    """
    reach = AROUND // 2
    padded = np.pad(y, reach, mode="reflect")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    off = y - median
    scatter = 1.4826 * float(np.median(np.abs(off))) or 1.0
    return np.where(np.abs(off) > STRAY * scatter, np.abs(off) / scatter, 0.0)
