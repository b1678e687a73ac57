"""A record by stretches: how loud the error is around each row, and how loud it usually is."""

import numpy as np


def rms(r: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(r**2)))
