"""Camera of the reel unit: where images stand in its window while the tape rests, and the share that it can scan.

    off = x - x_target - longer(T)

x is the tape that the capstan moved from print to scan position, longer(T) the length of the path between them beyond
that at the tension at which it was set (plants/physics/path_length.py). An image is printed and scanned at rest under
the same tension, as each move ends as the one before.

Source: thesis chapter 3, a window with a margin of +-0.5 mm.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

WINDOW = 0.5e-3  # m, to either side (3)
REST = 0.1  # s, before the next move, over which the camera looks


class Images(NamedTuple):
    """Images of one machine, at several places of the tape."""

    off: np.ndarray  # (n,) m, from where they should be, in the direction of transport
    centre: float  # m, to which the window is set
    half_range: float  # m
    share: float  # of the images in the window


def images(off: Sequence[float], centre: float = 0.0) -> Images:
    """Figures of merit of images that are `off` (n,) m, in a window whose middle is set to `centre` m."""
    at = np.asarray(off, float)
    within = np.abs(at - centre) <= WINDOW
    return Images(at, centre, 0.5 * float(np.ptp(at)), float(within.mean()))


def at_rest(t: np.ndarray, values: np.ndarray, end: float) -> float:
    """Mean of values (n,) over the last moment before `end`, where the machine rests; times in s."""
    return float(np.mean(values[(t > end - REST) & (t <= end)]))
