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


def in_blocks(x: np.ndarray, block: int) -> np.ndarray:
    """Sums of x (n, ...) over `block` rows each (n // block, ...), the rest left out."""
    return np.asarray(x[: len(x) // block * block].reshape(-1, block, *x.shape[1:]).sum(axis=1))


def usual(r: np.ndarray) -> float:
    """Median of the rms of stretches: a few loud ones do not count."""
    return float(np.median(loudness(r))) + 1e-9


def memory(r: np.ndarray, most: int = 500) -> float:
    """Errors that count as one: 1 + 2 sum of the autocorrelation up to where it is lost.

    Source: Geyer, Practical Markov chain Monte Carlo, Statistical Science 7 (1992).
    """
    e = r - r.mean()
    power = float(e @ e) or 1.0
    total = 1.0
    for lag in range(1, min(most, len(e) // 4)):
        rho = float(e[lag:] @ e[:-lag]) / power
        if rho < 0.05:
            break
        total += 2.0 * rho
    return total
