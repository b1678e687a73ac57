"""Whether what is left is hiss: forces without any pattern, which a machine makes and no hypothesis explains.

The correction that keeps a model on track lets a force d (per unit of inertia) through to the error e by
e'' + 1.4 w e' + w^2 e = d. White d has a flat spectrum up to w and beyond; friction, drifts and ripples have not. A
peak, a rise to low frequencies, or more error than that flat level accounts for, are no hiss.

Source: Bartlett, An introduction to stochastic processes (1955), for the cumulative periodogram and its bound.
"""

import numpy as np

FROM = 4.0  # periods in the record, of the lowest frequency looked at
UPTO = 1.2  # of the correction's bandwidth
BOUND = 1.8  # of the cumulative periodogram's distance times the root of the count; 1.63 is one in a hundred
MORE = 1.6  # times the error that the level accounts for
FEWEST = 20  # frequencies


def is_hiss(e: np.ndarray, dt: float, follow: float, floor: float) -> bool:
    """Of the error e (n,), `dt` s apart, of a model that follows at `follow` rad/s and whose sensor leaves `floor`."""
    n = len(e)
    taper = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.05 * n))
    w = 2 * np.pi * np.fft.rfftfreq(n, dt)
    through = (follow**2 - w**2) + 1.4j * follow * w
    power = np.abs(np.fft.rfft((e - e.mean()) * taper)) ** 2
    band = (w > 2 * np.pi * FROM / (n * dt)) & (w < UPTO * follow)
    if band.sum() < FEWEST:
        return False
    force = power[band] * np.abs(through[band]) ** 2
    rising = np.cumsum(force) / force.sum()
    count = len(force)
    if np.abs(rising - np.arange(1, count + 1) / count).max() * np.sqrt(count) > BOUND:
        return False
    passed = float(np.sum(force.mean() / np.abs(through[1:]) ** 2)) * 2 / (n * float(np.sum(taper**2)))
    return float(np.var(e)) < MORE * (passed + floor**2)
