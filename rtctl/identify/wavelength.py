"""Fourier analysis over the position: which wavelengths a position error has, and where each comes from.

    E(lambda_k) = 1/N sum e(n) exp(-j 2 pi n dx / lambda_k),   lambda_k = x_e / k,   N = x_e / dx            (11.10)

The error is laid on even steps of position, loses its trend and gets a Hann window. The highest bin that stands above
what the neighbourhood's noise gives by chance is a line; a sine of free wavelength is fitted to it and taken away, and
what is left is looked at again, until nothing stands out: so 150 and 300 mm are told apart though the window smears
them into each other. All sines are fitted at once, for amplitudes and wavelengths that are not bound to the bins: the
thesis's 18.75 mm is the bin x_e / 32 next to the 18.86 mm of the capstan.

One record cannot tell what repeats with position from what repeats with time. Two at different speeds can: a wavelength
that stays belongs to the position, one that grows with the speed to the time (figure 11.7 with 11.4).

Source: thesis (11.10), 11.2; Harris 1978 for the window; Rife & Boorstyn 1974 for the bound on the wavelength.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer

HANN_GAIN = 0.5  # mean of the window
NEAR = 2  # bins that a Hann window smears one line over, to either side
SURE = 0.999  # that no peak of a record is chance
ROOM = 30  # bins to either side that tell the noise
MEDIAN_WORTH = 0.32  # of a bin, in a median (0.48) of bins that the window smears over 1.5


class Spectrum(NamedTuple):
    wavelength: np.ndarray  # m, (N/2,), x_e / k for k = 1 .. N/2
    E: np.ndarray  # m, complex (N/2,), (11.10) as printed, with the window
    amplitude: np.ndarray  # m, (N/2,), of a sine that would give it: 2 |E| / (mean of the window)
    noise: np.ndarray  # m, (N/2,), the same of the noise around
    x: np.ndarray  # m, (N,)
    e: np.ndarray  # m, (N,), without trend, before the window


class Peak(NamedTuple):
    bin: float  # m, wavelength of the bin, as in the thesis
    wavelength: float  # m, fitted
    half: float  # m, 95 %
    amplitude: float  # m, fitted
    amplitude_half: float  # m, 95 %
    phase: float  # rad, of a sine at x = 0
    confidence: float  # that it is no chance
    order: float | None  # times a turn of the capstan


class Origin(NamedTuple):
    """A peak of one speed and its fellow at the other."""

    kind: Literal["position", "time", "either", "neither"]
    wavelength: float  # m, at the first speed
    frequency: float  # Hz, at the first speed
    fellow: float | None  # m, at the second speed


def spectrum(x: np.ndarray, e: np.ndarray, N: int = 1200, x_e: float | None = None) -> Spectrum:
    """(11.10) for the error `e` (m, (n,)) over rising positions `x` (m, (n,)), on `N` steps over `x_e` m.

    Raises NoAnswer where the record is shorter than `x_e` or has fewer than `N` samples.
    """
    length = float(np.ptp(x))
    x_e = length if x_e is None else x_e
    if length < x_e * (1 - 2.0 / N):
        raise NoAnswer(f"the record covers {1e3 * length:.1f} mm; the analysis is over {1e3 * x_e:.1f} mm")
    if len(x) < N:
        raise NoAnswer(f"{len(x)} samples over {1e3 * length:.0f} mm do not fill {N} steps")
    grid = x[0] + x_e * np.arange(N) / N
    order = np.maximum.accumulate(x)  # a count may flicker back
    y = np.interp(grid, order, e)
    y = y - np.polyval(np.polyfit(grid, y, 1), grid)
    E = _hann(y)
    amplitude = 2.0 * np.abs(E) / HANN_GAIN
    return Spectrum(x_e / np.arange(1, len(E) + 1), E, amplitude, confidence(amplitude)[0], grid - x[0], y)


def peaks(s: Spectrum, R_c: float | None = None, most: int = 12) -> tuple[Peak, ...]:
    """Peaks of a spectrum, longest wavelength first; `R_c` (m) gives their order.

    Raises NoAnswer where nothing stands above the noise.
    """
    periods = np.zeros(0)
    confidences: list[float] = []
    left, fit = s.e, None
    while len(periods) < most:
        amplitude = 2.0 * np.abs(_hann(left)) / HANN_GAIN
        noise, sure = confidence(amplitude)
        top = int(np.argmax(amplitude / noise))
        close = np.abs(periods - (top + 1)) < 1.0  # what is left of a line that is no pure sine
        if sure[top] < SURE or close.any():
            break
        periods = np.append(periods, top + 1.0)
        confidences.append(float(sure[top]))
        fit = _sines(s, periods)
        periods, left = fit.periods, fit.rest
    if fit is None:
        raise NoAnswer(f"no wavelength stands above the noise of {1e6 * float(np.median(s.noise)):.2g} um")
    x_e = float(s.wavelength[0])
    out = [
        Peak(
            bin=x_e / max(round(k), 1),
            wavelength=x_e / k,
            half=float(x_e / k * fit.periods_half[i] / k),
            amplitude=float(np.hypot(*fit.sin_cos[i])),
            amplitude_half=float(fit.amplitude_half[i]),
            phase=float(np.arctan2(fit.sin_cos[i, 1], fit.sin_cos[i, 0])),
            confidence=confidences[i],
            order=None if R_c is None else 2.0 * np.pi * R_c * k / x_e,
        )
        for i, k in enumerate(periods.tolist())
    ]
    return tuple(sorted(out, key=lambda peak: -peak.wavelength))


def origin(first: Sequence[Peak], speed: float, second: Sequence[Peak], other: float) -> tuple[Origin, ...]:
    """What each peak of the `first` record (at `speed` m/s) goes with, by its fellow in the `second` (at `other` m/s).

    Raises NoAnswer where the speeds are so alike that a peak could be both.
    """
    if abs(np.log(other / speed)) < np.log(1.2):
        raise NoAnswer(f"speeds of {speed:g} and {other:g} m/s are too alike; take one 1.2 times the other or more")
    out = []
    for peak in first:
        stays = _fellow(second, peak, peak.wavelength)
        moves = _fellow(second, peak, peak.wavelength * other / speed)
        kind: Literal["position", "time", "either", "neither"]
        kind = "either" if stays and moves else "position" if stays else "time" if moves else "neither"
        fellow = stays or moves
        out.append(Origin(kind, peak.wavelength, speed / peak.wavelength, fellow.wavelength if fellow else None))
    return tuple(out)


def _fellow(second: Sequence[Peak], peak: Peak, wavelength: float) -> Peak | None:
    """The peak of the second record at a wavelength, within what both can resolve."""
    best = min(second, key=lambda p: abs(np.log(p.wavelength / wavelength)), default=None)
    if best is None:
        return None
    width = peak.half / peak.wavelength + best.half / best.wavelength + 0.02
    return best if abs(np.log(best.wavelength / wavelength)) < width else None


def confidence(amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Noise around every bin (its Rayleigh parameter), and how sure it is that a bin is no chance, both (k,).

    The noise is the median of the bins around but for its own line. It is itself uncertain, which makes the tail of the
    ratio that of an F distribution, P = (1 + r^2 / 2 m)^-m, with m the number of bins that a median is worth.
    """
    count = len(amplitude)
    noise, worth = np.empty(count), np.empty(count)
    for k in range(count):
        lo, hi = max(0, k - ROOM), min(count, k + ROOM + 1)
        near = np.concatenate((amplitude[lo : max(k - NEAR, lo)], amplitude[k + NEAR + 1 : hi]))
        noise[k] = np.median(near) / np.sqrt(2.0 * np.log(2.0)) if len(near) else np.inf
        worth[k] = max(len(near) * MEDIAN_WORTH, 1.0)
    noise = np.maximum(noise, 1e-6 * amplitude.max(initial=1e-30))
    chance = (1.0 + 0.5 * (amplitude / noise) ** 2 / worth) ** -worth
    return noise, (1.0 - chance) ** count


class Sines(NamedTuple):
    periods: np.ndarray  # (n,) in the length of the record
    periods_half: np.ndarray  # (n,) 95 %
    sin_cos: np.ndarray  # m, (n, 2)
    amplitude_half: np.ndarray  # m, (n,) 95 %
    rest: np.ndarray  # m, (N,)


def _sines(s: Spectrum, start: np.ndarray) -> Sines:
    """Sines of free wavelength, all fitted at once with a new trend, by variable projection (Golub & Pereyra 1973)."""
    from scipy.optimize import least_squares

    u = s.x / s.wavelength[0]
    n = len(start)

    def columns(k: np.ndarray) -> np.ndarray:
        turns = 2.0 * np.pi * np.outer(u, k)
        return np.column_stack((np.sin(turns), np.cos(turns), np.ones_like(u), u))

    def rest(k: np.ndarray) -> np.ndarray:
        M = columns(k)
        return s.e - M @ np.linalg.lstsq(M, s.e, rcond=None)[0]

    low, high = np.maximum(start - 1.0, 0.4), start + 1.0
    k = least_squares(lambda k: 1e6 * rest(k), np.clip(start, low + 1e-9, high), bounds=(low, high), x_scale=0.1).x
    M = columns(k)
    a = np.linalg.lstsq(M, s.e, rcond=None)[0]
    slopes = 2.0 * np.pi * u[:, None] * (M[:, n : 2 * n] * a[:n] - M[:, :n] * a[n : 2 * n])
    J = np.column_stack((M, slopes))
    r = s.e - M @ a
    # what is left is smooth: it has as many independent samples as it changes sign, not as there are steps
    independent = max(np.count_nonzero(np.diff(np.sign(r)) != 0) - J.shape[1], 1)
    scale = np.linalg.norm(J, axis=0)
    covariance = np.linalg.pinv((J / scale).T @ (J / scale)) * float(r @ r) / independent
    half = 2.0 * np.sqrt(np.maximum(np.diag(covariance), 0.0)) / scale
    amplitude_half = np.hypot(half[:n], half[n : 2 * n]) / np.sqrt(2.0)
    return Sines(k, half[2 * n + 2 :], np.column_stack((a[:n], a[n : 2 * n])), amplitude_half, r)


def _hann(y: np.ndarray) -> np.ndarray:
    """(11.10) of `y` (N,) under the window, for k = 1 .. N/2."""
    N = len(y)
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(N) / N)
    return np.fft.rfft(window * y)[1:] / N
