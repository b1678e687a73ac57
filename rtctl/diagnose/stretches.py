"""A record by stretches: how loud the error is around each row, and how loud it usually is."""

import numpy as np

LENGTH = 100  # errors


def rms(r: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(r**2)))


def loudness(r: np.ndarray) -> np.ndarray:
    """Rms of the errors r (n,) in the stretch that each lies in, (n,)."""
    count = max(len(r) // LENGTH, 1)
    index = np.minimum(np.arange(len(r)) * count // max(len(r), 1), count - 1)
    return np.sqrt(np.bincount(index, r**2) / np.bincount(index))[index]


def usual(r: np.ndarray) -> float:
    """Median of the rms of stretches: a few loud ones do not count."""
    return float(np.median(loudness(r))) + 1e-9
