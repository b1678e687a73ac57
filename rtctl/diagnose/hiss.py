"""Whether what is left is hiss: forces without any pattern, which a machine makes and no hypothesis explains.

The correction that keeps a model on track lets a force d (per unit of inertia) through to the error e by
e'' + 1.4 w e' + w^2 e = d. Where d is white and the sensor's own noise is white beside it, the spectrum of e has that
shape, with one unknown level. Friction, drifts and ripples have another: a peak, a rise to low frequencies, or more
error than that level accounts for, are no hiss.

Source: Bartlett, An introduction to stochastic processes (1955), for the cumulative periodogram and its bound.
"""

import numpy as np

FROM = 4.0  # periods in the record, of the lowest frequency looked at
UPTO = 3.0  # of the correction's bandwidth
BOUND = 2.4  # of the cumulative periodogram's distance times the root of the count; 1.63 is one in a hundred
MORE = 1.6  # times the error that the level accounts for
FEWEST = 20  # frequencies
ROUNDS = 20


def is_hiss(e: np.ndarray, dt: float, follow: float, floor: float) -> bool:
    """Of the error e (n,), `dt` s apart, of a model that follows at `follow` rad/s and whose sensor leaves `floor`."""
    n = len(e)
    taper = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.05 * n))
    w = 2 * np.pi * np.fft.rfftfreq(n, dt)
    through = 1.0 / np.abs((follow**2 - w**2) + 1.4j * follow * w) ** 2
    power = np.abs(np.fft.rfft((e - e.mean()) * taper)) ** 2 / float(np.sum(taper**2))
    band = (w > 2 * np.pi * FROM / (n * dt)) & (w < UPTO * follow)
    count = int(band.sum())
    if count < FEWEST:
        return False
    power, passed = power[band], through[band]
    level = 0.0
    for _ in range(ROUNDS):  # the likelihood of a periodogram weighs each frequency by what it expects there
        expected = level * passed + floor**2 if level else passed / passed.max() * power.max()
        gain = passed / expected**2
        level = max(float(gain @ (power - floor**2)) / float(gain @ passed), 0.0)
    likely = power / (level * passed + floor**2)
    rising = np.cumsum(likely) / likely.sum()
    if np.abs(rising - np.arange(1, count + 1) / count).max() * np.sqrt(count) > BOUND:
        return False
    accounted = level * float(np.sum(through[1:])) * 2 / n
    return float(np.var(e)) < MORE * (accounted + floor**2)
