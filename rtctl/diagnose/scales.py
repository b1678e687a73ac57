"""How fast, how far and how hard each node of a recording moves: what is large and what is small on this machine."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

SMOOTH = {"ivu": 0.01, "ldu": 2e-3, "axis": 5e-3}  # s, over which a speed is taken


def speed(x: np.ndarray, kind: str, dt: float) -> np.ndarray:
    """Rate (n,) of a reading, over a few ticks."""
    return np.gradient(uniform_filter1d(x, 2 * max(1, round(SMOOTH[kind] / dt)) + 1), dt)


def spaced(values: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """Places (count,) among sorted values (n,): each step has the same sum of its shares of the way from low to high
    and of the values."""
    share = 0.5 * ((values - low) / ((high - low) or 1.0) + np.linspace(0.0, 1.0, len(values)))
    return np.interp(np.linspace(0.0, 1.0, count), share, values)


class Scales(NamedTuple):
    """Of one node: rms speed while it moves, span of its position, rms of the force that the drives put on it."""

    speed: float
    span: float
    force: float
    low: float  # lowest position
    back: bool = False  # whether it goes down as the main sensor goes up

    def at(self, share: float) -> float:
        """Position of the node where the main sensor has gone that share of its span."""
        return self.low + self.span * (1.0 - share if self.back else share)
