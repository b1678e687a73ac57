"""Slow residuals of the followed sensors, which an autoregression predicts at any size.

A likelihood of innovations alone takes a slow error of a model for coloured noise. The residual, averaged over windows,
therefore counts beside its innovations. Its variance is the sum of its mean square and that of an error of the laws: a
small share of the force that moves the machine.

Source: Brynjarsdottir & O'Hagan, Learning about physical parameters: the importance of model discrepancy, Inverse
Problems 30 (2014).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.calibration import SLOW_ERROR
from rtctl.diagnose.model.kernel import TRACK
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.model.observer import stiffness
from rtctl.diagnose.model.simulate import Simulator


class Slow(NamedTuple):
    """Slow residual of a followed sensor."""

    column: int  # index among the channels
    width: int  # blocks of a window
    least: float  # SI: standard deviation by an error of the laws
    sigma: float  # SI: standard deviation of the averaged residual

    def of(self, e: np.ndarray) -> np.ndarray:
        """Averages (windows, ...) of residuals (blocks, sensors, ...), SI."""
        count = len(e) // self.width
        own = e[: count * self.width, self.column]
        return np.asarray(own.reshape(count, self.width, *e.shape[2:]).mean(axis=1))

    def told(self, e: np.ndarray) -> "Slow":
        """Slow residual with the standard deviation that residuals (blocks, sensors) show."""
        return self._replace(sigma=self._size(self.of(e)))

    def _size(self, own: np.ndarray) -> float:
        """Standard deviation, SI, of averages (windows,)."""
        return float(np.hypot(self.least, np.sqrt(np.mean(own**2)))) if len(own) else self.sigma

    def losses(self, e: np.ndarray, count: int) -> np.ndarray:
        """Negative logarithm of the likelihood of residuals (blocks, sensors) by segment (count,), nats, up to a
        constant."""
        own = self.of(e)
        sigma = self._size(own)
        segment = np.arange(len(own)) * count // max(len(own), 1)
        return np.bincount(segment, 0.5 * (own / sigma) ** 2 + np.log(sigma / self.least), count)


def slow(sim: Simulator, channels: Sequence[int], mean: int) -> list[Slow]:
    """Slow residuals of the followed sensors among the `channels`, for blocks of `mean` ticks."""
    if sim.mode != TRACK:
        return []
    measures, out = Measures(sim, nominal(sim.case).base, {}), []
    for one in sim.followed:
        column, follow = sim.column(one.sensor), sim.bandwidth(one)
        if column in channels:
            stiff = stiffness(follow, measures.inertia(one.body))[one.shows_speed]
            least = SLOW_ERROR * measures.of("force", one.body) / stiff
            out.append(Slow(list(channels).index(column), max(1, round(sim.window / mean)), least, least))
    return out
