"""Camera of the reel unit: position of images in its window at rest of the tape, and the share it can scan.

    off = x - x_target - longer(T)

x is the tape that the capstan moved from print to scan position. longer(T) is the increase of the path length between
them at tension T over the length at adjustment (plants/physics/path_length.py). An image is printed and scanned at rest
under equal tension: all moves end alike.

Source: thesis chapter 3, a window with a margin of +-0.5 mm.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

WINDOW = 0.5e-3  # m, to either side (3)
REST = 0.1  # s, averaging time of the camera before the next move


class Images(NamedTuple):
    """Images of one machine, at several places of the tape."""

    off: np.ndarray  # (n,) m, deviation from the nominal position, in the direction of transport
    centre: float  # m, centre of the window
    half_range: float  # m
    share: float  # share of the images in the window


def images(off: Sequence[float], centre: float = 0.0) -> Images:
    """Figures of merit of images with deviations `off` (n,) in m, for a window around `centre` in m."""
    at = np.asarray(off, float)
    within = np.abs(at - centre) <= WINDOW
    return Images(at, centre, 0.5 * float(np.ptp(at)), float(within.mean()))


def at_rest(t: np.ndarray, values: np.ndarray, end: float) -> float:
    """Mean of values (n,) over the last REST s before `end`, where the machine rests; times in s."""
    return float(np.mean(values[(t > end - REST) & (t <= end)]))
