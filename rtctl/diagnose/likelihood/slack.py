"""Slack: errors of the laws of a model, integrated out of its likelihood.

No law is exact. The change of the residual by an effect may be wrong by a share of it, smoothly along the change and
along the speed of the machine. The errors are columns beside the parameters, each with a normal prior: the covariance
of a residual is the sum of the covariances of the noise and of these columns. A further effect then counts only for the
part that no small error of the laws explains.

Source: Brynjarsdottir & O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse
Problems 30 (2014); Woodbury's identity for the covariance.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.calibration import LAW_ERROR

ORDER = 3  # order of the polynomials in the effect, and in the speed
WIDTHS = (1, 4, 16, 64)  # blocks: windows of the averages between which bands of frequency lie


class Inexact(NamedTuple):
    """Errors (blocks, sensors, columns) of a description, of standard deviation one."""

    laws: np.ndarray  # of its own laws, before a factor for the exactness of all laws
    unseen: np.ndarray  # of effects below the resolution of a sensor


def columns(effect: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Errors (blocks, sensors, columns) of an effect (blocks, sensors) of a machine with the `speed` (blocks,).

    The columns are errors of size along the effect and along the speed, and errors of size and phase by bands of
    frequency.
    """
    done = effect / np.maximum(np.abs(effect).max(axis=0), 1e-300)
    fast = speed[:, None] / max(float(np.abs(speed).max(initial=0.0)), 1e-300)
    along = [legvander(done, ORDER), legvander(fast, ORDER)[..., 1:] + 0.0 * effect[..., None]]
    smooth = effect[..., None] * np.concatenate(along, axis=2)
    means = [uniform_filter1d(effect, width, axis=0) for width in WIDTHS]
    bands = [fine - coarse for fine, coarse in pairwise(means)]
    turned = [
        rate * _rms(band) / np.maximum(_rms(rate), 1e-300) for band in bands for rate in [np.gradient(band, axis=0)]
    ]
    parts = [LAW_ERROR / np.sqrt(smooth.shape[2]) * smooth, LAW_ERROR * np.stack([*bands, *turned], axis=2)]
    return np.asarray(np.concatenate(parts, axis=2))


def _rms(e: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(e**2, axis=0)))


class Slack:
    """Errors of the laws under one noise: `white` (innovations, columns), under a likelihood to the power `power`."""

    def __init__(self, white: np.ndarray, power: float):
        self.white, self.power = white, power
        inner = white.T @ white
        inner[np.diag_indices_from(inner)] += 1.0 / power
        self.factor = cho_factor(inner)

    def size(self, r: np.ndarray) -> np.ndarray:
        """Most probable errors (columns, ...) for the innovations r (innovations, ...)."""
        return np.asarray(-cho_solve(self.factor, self.white.T @ r))

    def stacked(self, r: np.ndarray) -> np.ndarray:
        """Innovations without the most probable errors, then the errors: half the sum of squares is the cost."""
        a = self.size(r)
        return np.concatenate([r + self.white @ a, a / np.sqrt(self.power)])

    @property
    def volume(self) -> float:
        """Half the logarithm of the determinant of the covariance, nats, divided by `power`."""
        spread = 2.0 * float(np.sum(np.log(np.diag(self.factor[0])))) + len(self.white.T) * np.log(self.power)
        return 0.5 * spread / self.power
