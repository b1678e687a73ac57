"""Speed sensor: noise estimate, and sign of a rectified speed.

A speed is measured by a generator or by the rate of pulses, filtered, and shows noise much larger than its resolution.
The residual of a long linear regression on the past of the speed and the command is the noise, for any machine. Dry
friction at reversals and rectification make a few rows nonlinear; robust weights leave these rows out.

Source: Ljung, System Identification (1999), 10.3 for high-order ARX models; Holland & Welsch, Robust regression using
iteratively reweighted least-squares, Communications in Statistics A6 (1977), for the weights.
"""

import numpy as np
from scipy.signal import lfilter

ORDER = 8  # rows, order of the regression
ROUNDS = 15  # rounds of reweighting
TUNE = 4.685  # constant of Tukey's weights: 95 % efficient for normal noise
NORMAL = 1.4826  # standard deviation over the median absolute deviation of normal noise
FEWEST = 5 * ORDER  # rows, at least
BACK = 0.05  # share of the highest speed, and of the time, for a rectified speed
LAGS, LONGEST = 25, 0.2  # number of lags that are tried; longest lag as a share of the record


def noise(y: np.ndarray, u: np.ndarray) -> float:
    """Standard deviation of the noise in a speed (n,) under commands (n, drives), in the speed's unit; 0 where the rows
    are too few."""
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
    """Whether a speed (n,) is rectified: never negative although the command (n,) has both signs."""
    return bool(speed.min() > -BACK * speed.max() and min(np.mean(u > 0), np.mean(u < 0)) > BACK)


def signed(speed: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Speed (n,); a rectified speed gets the sign of the command (n,) through the lag of highest correlation."""
    if not folded(speed, u):
        return speed
    lagged = [lfilter([1.0], [1.0 + lag, -lag], u) for lag in np.geomspace(1.0, LONGEST * len(u), LAGS)]
    return speed * np.sign(max(lagged, key=lambda v: float(np.abs(v) @ speed) / (float(np.linalg.norm(v)) or 1.0)))
