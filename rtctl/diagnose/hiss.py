"""Whether what is left is hiss: forces without any pattern, which a machine makes and no hypothesis explains.

The correction that keeps a model on track lets a force d (per unit of inertia) through to the error e by e'' + (1.4 w
+ b) e' + (w^2 + k) e = d, where b and k are the machine's own damper and spring. Where d is white, or white noise
through a lag that is shorter than the correction's own, and the sensor's noise is white beside it, the spectrum of e
has that shape, with a level and a lag that are unknown. Friction, drifts and ripples have another: a peak, a rise to
low frequencies, or more error than that level accounts for, are no hiss. Nor are errors that come in bursts, where it
turns or where it moves: the sum of many small forces is normal, with a kurtosis of 3. Nor is what the command of a
machine without a controller foretells.

Source: Bartlett, An introduction to stochastic processes (1955), for the cumulative periodogram and its bound; Whittle,
Arkiv for Matematik 2 (1953), for the likelihood of a spectrum.
"""

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.stretches import memory

FROM = 4.0  # periods in the record, of the lowest frequency looked at
UPTO = 3.0  # of the correction's bandwidth
BOUND, EXACT = 2.4, 1.63  # of the cumulative periodogram's distance times the root of the count
MORE = 1.6  # times the error that the level accounts for
FEWEST = 20  # frequencies
BURSTS, CHANCE = 1.2, 3.0  # kurtosis above 3, and the same in standard deviations of so many independent errors
ROUNDS = 20
EACH, BLOCKS = 6, 2  # lags in a block, and blocks
SHIFTS = 20  # other times
FORETOLD = 0.2  # share of what chance leaves
LAGS = (0.1, 0.2, 0.4, 0.7, 1.0)  # of the correction's own time


def is_hiss(
    e: np.ndarray,
    dt: float,
    follow: float,
    floor: float,
    exact: bool = False,
    speed: bool = False,
    own: tuple[float, float] = (0.0, 0.0),
) -> bool:
    """Of the error e (n,), `dt` s apart, of a model that follows at `follow` rad/s and whose sensor leaves `floor`.

    `exact`: with no more deviation than chance makes in one of a hundred. `speed`: what the sensor shows is one. `own`:
    damper (1/s) and spring (1/s^2) of the machine, per unit of inertia.
    """
    n = len(e)
    taper = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.05 * n))
    w = 2 * np.pi * np.fft.rfftfreq(n, dt)
    b, k = own
    through = 1.0 / np.abs(1j * w + 1.4 * follow if speed else follow**2 + k - w**2 + (1.4 * follow + b) * 1j * w) ** 2
    power = np.abs(np.fft.rfft((e - e.mean()) * taper)) ** 2 / float(np.sum(taper**2))
    band = (w > 2 * np.pi * FROM / (n * dt)) & (w < UPTO * follow)
    count = int(band.sum())
    if count < FEWEST or bursts(e):
        return False
    best: tuple[float, float, np.ndarray] | None = None
    for lag in (0.0, *np.array(LAGS) / follow):
        shape = through / (1.0 + (lag * w) ** 2)
        level = _level(power[band], shape[band], floor)
        expected = level * shape[band] + floor**2
        unlikely = float(np.sum(np.log(expected) + power[band] / expected))  # Whittle's likelihood
        if best is None or unlikely < best[0]:
            best = unlikely, level, shape
    assert best is not None
    _, level, through = best
    likely = power[band] / (level * through[band] + floor**2)
    rising = np.cumsum(likely) / likely.sum()
    if np.abs(rising - np.arange(1, count + 1) / count).max() * np.sqrt(count) > (EXACT if exact else BOUND):
        return False
    accounted = level * float(np.sum(through[1:])) * 2 / n
    return float(np.var(e)) < MORE * (accounted + floor**2)


def commanded(e: np.ndarray, inputs: np.ndarray, block: int) -> bool:
    """Whether the inputs (n, k) of the last few `block` rows foretell the errors e (n,), which last for a block.

    Where no controller answers the error, hiss has nothing to do with what was commanded: it is foretold no better than
    by the same inputs at any other time.
    """
    step = max(1, block // EACH)
    u, e = (uniform_filter1d(x, step, axis=0)[::step] for x in (inputs, e))
    most = EACH * BLOCKS
    if len(e) < 3 * most:
        return False
    b = e[most:] - e[most:].mean()

    def share(shift: int) -> float:
        moved = np.roll(u, shift, axis=0)
        A = np.column_stack([moved[most - lag : len(e) - lag] for lag in range(most)])
        A = A - A.mean(axis=0)
        return 1.0 - float(np.var(b - A @ np.linalg.lstsq(A, b, rcond=1e-6)[0]) / np.var(b))

    others = [share(int(k)) for k in np.linspace(0.1, 0.9, SHIFTS) * len(e)]
    usual = float(np.median(others))
    return share(0) > max(*others, usual + FORETOLD * (1.0 - usual))


def bursts(e: np.ndarray) -> bool:
    """Whether the errors e (n,) are large for some of the time, more so than normal ones that hang together alike."""
    off = e - e.mean()
    kurtosis = float(np.mean(off**4) / max(float(np.mean(off**2)) ** 2, 1e-300))
    return kurtosis > 3.0 + BURSTS and kurtosis > 3.0 + CHANCE * float(np.sqrt(24.0 * memory(e) / len(e)))


def _level(power: np.ndarray, passed: np.ndarray, floor: float) -> float:
    """Of forces whose noise of unit power comes through as `passed`, beside the floor."""
    level = 0.0
    for _ in range(ROUNDS):  # the likelihood of a periodogram weighs each frequency by what it expects there
        expected = level * passed + floor**2 if level else passed / passed.max() * power.max()
        gain = passed / expected**2
        level = max(float(gain @ (power - floor**2)) / float(gain @ passed), 0.0)
    return level
