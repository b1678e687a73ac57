"""Recorded motion of held bodies: of the main sensor in a static or kinematic problem, and of measured inputs.

Force follows from acceleration, and quantisation makes a large acceleration: the motion of a static problem is smoothed
over a time in which a force law hardly changes. A kinematic problem predicts positions: its motion is not smoothed.
"""

from typing import NamedTuple

import numpy as np
from scipy.signal import savgol_filter

from rtctl.diagnose.model.recording import GraphRecord

OVER = 0.15  # s, window of the cubic smoothing of a static problem
LEAST = 7  # rows of the window, at least


class Path(NamedTuple):
    """Motion of a body, (n,) each."""

    body: str
    x: np.ndarray  # rad or m
    v: np.ndarray  # rad/s or m/s


def main_path(record: GraphRecord) -> Path:
    """Motion of the main sensor's body."""
    sensor = record.case.machine.sensors[record.main]
    x = record.y[record.main]
    if sensor.measures == "speed":
        x = np.cumsum(x) * record.dt
    return moved(str(sensor.body), x, record.dt, record.case.problem == "static")


def paths(record: GraphRecord) -> list[Path]:
    """Motions of the bodies whose position is a measured input."""
    return [moved(body, x, record.dt, True) for body, x in record.positions.items()]


def moved(body: str, x: np.ndarray, dt: float, smooth: bool) -> Path:
    """Motion of a body from positions x (n,), rad or m; `smooth` where the force of the motion counts."""
    if not smooth:
        return Path(body, np.asarray(x, float), np.gradient(x, dt))
    window = min(max(LEAST, round(OVER / dt)) | 1, (len(x) - 1) | 1)
    filtered = [savgol_filter(x, window, 3, deriv=order, delta=dt) for order in (0, 1)]
    return Path(body, filtered[0], filtered[1])
