"""Slack: what the laws of a model may be wrong by, integrated out of its likelihood.

No law is exact. What an effect does may be off by a share of it, smoothly along what it does and along the speed of the
machine. The errors are columns beside the parameters, each with a normal prior, so that the covariance of a residual is
that of the noise and of these columns. A further effect then counts only for what no small error of the laws explains.

Source: Brynjarsdottir & O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse
Problems 30 (2014); Woodbury's identity for the covariance.
"""

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import cho_factor, cho_solve

OFF = 0.05  # of what an effect does: standard deviation of its error
ORDER = 3  # of the polynomials along what it does, and along the speed


def columns(effect: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Errors (blocks, sensors, columns) of standard deviation one of an effect (blocks, sensors) that is seen while the
    machine moves with `speed` (blocks,)."""
    done = effect / np.maximum(np.abs(effect).max(axis=0), 1e-300)
    fast = speed[:, None] / max(float(np.abs(speed).max(initial=0.0)), 1e-300)
    smooth = np.concatenate([legvander(done, ORDER), legvander(fast, ORDER)[..., 1:] + 0.0 * effect[..., None]], axis=2)
    return np.asarray(OFF / np.sqrt(smooth.shape[2]) * effect[..., None] * smooth)


class Slack:
    """Errors under one noise: `white` (innovations, columns) are their innovations, of which `power` counts."""

    def __init__(self, white: np.ndarray, power: float):
        self.white, self.power = white, power
        inner = white.T @ white
        inner[np.diag_indices_from(inner)] += 1.0 / power
        self.factor = cho_factor(inner)

    def size(self, r: np.ndarray) -> np.ndarray:
        """Errors (columns, ...) that suit the innovations r (innovations, ...) best."""
        return np.asarray(-cho_solve(self.factor, self.white.T @ r))

    def stacked(self, r: np.ndarray) -> np.ndarray:
        """Innovations that the errors leave, and the errors beneath: half the sum of squares is the cost."""
        a = self.size(r)
        return np.concatenate([r + self.white @ a, a / np.sqrt(self.power)])

    @property
    def volume(self) -> float:
        """Half the logarithm of the determinant, nats, of which the share `power` counts."""
        spread = 2.0 * float(np.sum(np.log(np.diag(self.factor[0])))) + len(self.white.T) * np.log(self.power)
        return 0.5 * spread / self.power
