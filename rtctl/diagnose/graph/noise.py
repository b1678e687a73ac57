"""Noise of a sensor's residual: an autoregression that whitens it, and the variance of what it cannot predict.

Source: Ljung, System Identification (1999), ch. 4; Kay, Modern Spectral Estimation (1988), ch. 7 for the covariance
method with both directions of time.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter


class Noise(NamedTuple):
    """Autoregression of one sensor's residual."""

    a: np.ndarray  # (p + 1,) whitening filter, a[0] = 1
    sigma: float  # standard deviation of the innovation

    @property
    def order(self) -> int:
        """Number of past values."""
        return len(self.a) - 1

    def whiten(self, e: np.ndarray) -> np.ndarray:
        """Innovations (n - p, ...) of residuals (n, ...), by their standard deviation."""
        if e.size == 0:  # of no fitted parameter
            return np.zeros((max(len(e) - self.order, 0), *e.shape[1:]))
        return np.asarray(lfilter(self.a, [1.0], e, axis=0)[self.order :] / self.sigma)


def noise_of(e: np.ndarray, order: int, least: float) -> Noise:
    """Autoregression of `order` of a residual (n,) about its mean, whose innovation is not below `least`.

    A constant is no noise: it stays in the innovations as the force that makes it.
    """
    n = len(e)
    e = e - e.mean()
    order = min(order, n // 20)
    r = np.array([e[lag:] @ e[: n - lag] for lag in range(order + 1)]) / n
    r[0] = r[0] * (1.0 + 1e-9) + 1e-300
    a = np.concatenate([[1.0], -solve_toeplitz(r[:-1], r[1:])]) if order else np.ones(1)
    innovation = lfilter(a, [1.0], e)[order:]
    return Noise(a, max(float(np.sqrt(np.mean(innovation**2))), least))
