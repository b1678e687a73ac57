"""What is peculiar to a sensor of speed: its noise, which nobody states as the step of a position is stated, and that
it may not know direction.

A speed is measured by a generator or by the rate of pulses, filtered, and shows noise much larger than its last digit.
What a long linear regression on the speed's own past and the command cannot predict is that noise, whatever the
machine is; where friction reverses or a sensor folds the speed over, a few rows are not linear, and robust weights
leave them out.

Source: Ljung, System Identification (1999), 10.3 for high-order ARX models; Holland & Welsch, Robust regression using
iteratively reweighted least-squares, Communications in Statistics A6 (1977), for the weights.
"""

import numpy as np
from scipy.signal import lfilter

ORDER = 8  # rows of the past
ROUNDS = 15
TUNE = 4.685  # of Tukey's weights: 95 % efficient where all is normal
NORMAL = 1.4826  # standard deviation by the median of sizes
FEWEST = 5 * ORDER  # rows
BACK = 0.05  # share of the highest speed, and of the time
LAGS, LONGEST = 25, 0.2  # lags tried, in ticks, up to that share of the record


def noise(y: np.ndarray, u: np.ndarray) -> float:
    """Standard deviation of the noise in a speed (n,) under commands (n, drives), in the speed's unit; 0 where the rows
    are too few to tell."""
    if len(y) < FEWEST:
        return 0.0
    past = [y[ORDER - k : len(y) - k] for k in range(1, ORDER + 1)]
    commands = [column[ORDER - k : len(y) - k] for column in u.T for k in range(ORDER + 1)]
    A, b = np.stack([np.ones(len(y) - ORDER), *past, *commands], axis=1), y[ORDER:]
    weights = np.ones(len(b))
    for _ in range(ROUNDS):
        e = b - A @ np.linalg.lstsq(A * weights[:, None], b * weights, rcond=None)[0]
        sigma = NORMAL * float(np.median(np.abs(e)))
        if sigma <= 1e-12 * float(np.abs(b).max(initial=0.0)):
            break
        weights = np.maximum(1.0 - (e / (TUNE * sigma)) ** 2, 0.0)  # root of Tukey's, as least squares takes it
    return sigma


def folded(speed: np.ndarray, u: np.ndarray) -> bool:
    """Whether a speed (n,) never goes below zero although the command (n,) pushes both ways."""
    return bool(speed.min() > -BACK * speed.max() and min(np.mean(u > 0), np.mean(u < 0)) > BACK)


def signed(speed: np.ndarray, u: np.ndarray) -> np.ndarray:
    """A speed (n,), where it is folded with the sign of the command (n,) through the lag that makes them most alike."""
    if not folded(speed, u):
        return speed
    lagged = [lfilter([1.0], [1.0 + lag, -lag], u) for lag in np.geomspace(1.0, LONGEST * len(u), LAGS)]
    return speed * np.sign(max(lagged, key=lambda v: float(np.abs(v) @ speed) / (float(np.linalg.norm(v)) or 1.0)))
