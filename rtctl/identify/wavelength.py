"""Fourier analysis over position: wavelengths of a position error, and the origin of each wavelength.

    E(lambda_k) = 1/N sum e(n) exp(-j 2 pi n dx / lambda_k),   lambda_k = x_e / k,   N = x_e / dx            (11.10)

The error is resampled at even steps of position, detrended and windowed (Hann). The highest bin significantly above the
surrounding noise is a line. A sine of free wavelength is fitted and subtracted, and the search repeats on the residual
until no line is significant. This separates 150 and 300 mm, which the window smears into each other. All sines are
fitted together: their wavelengths are not bound to the bins. The thesis's 18.75 mm is the bin x_e / 32 next to the
18.86 mm of the capstan.

One record cannot separate periods of position from periods of time. Two records at different speeds can: a constant
wavelength belongs to position, a wavelength proportional to speed belongs to time (figure 11.7 with 11.4).

Source: thesis (11.10), 11.2; Harris 1978 for the window; Rife & Boorstyn 1974 for the bound on the wavelength.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer

HANN_GAIN = 0.5  # mean of the window
NEAR = 2  # width of a line under a Hann window, in bins to either side
SURE = 0.999  # confidence that no peak of a record is noise
ROOM = 30  # bins to either side for the noise level
MEDIAN_WORTH = 0.32  # effective share of a bin in a median (0.48), with bins correlated over 1.5 by the window


class Spectrum(NamedTuple):
    wavelength: np.ndarray  # m, (N/2,), x_e / k for k = 1 .. N/2
    E: np.ndarray  # m, complex (N/2,), (11.10) as printed, with the window
    amplitude: np.ndarray  # m, (N/2,), amplitude of the equivalent sine: 2 |E| / (mean of the window)
    noise: np.ndarray  # m, (N/2,), amplitude of the surrounding noise
    x: np.ndarray  # m, (N,)
    e: np.ndarray  # m, (N,), without trend, before the window


class Peak(NamedTuple):
    bin: float  # m, wavelength of the bin, as in the thesis
    wavelength: float  # m, fitted
    half: float  # m, half width of the 95 % interval
    amplitude: float  # m, fitted
    amplitude_half: float  # m, half width of the 95 % interval
    phase: float  # rad, of a sine at x = 0
    confidence: float  # that the peak is no noise
    order: float | None  # periods per turn of the capstan


class Origin(NamedTuple):
    """Peak at one speed and its counterpart at the other speed."""

    kind: Literal["position", "time", "either", "neither"]
    wavelength: float  # m, at the first speed
    frequency: float  # Hz, at the first speed
    fellow: float | None  # m, at the second speed


def spectrum(x: np.ndarray, e: np.ndarray, N: int = 1200, x_e: float | None = None) -> Spectrum:
    """Spectrum by (11.10) of the error `e` (m, (n,)) over rising positions `x` (m, (n,)), in `N` steps over `x_e` m.

    Raises NoAnswer where the record is shorter than `x_e` or has fewer than `N` samples.
    """
    length = float(np.ptp(x))
    x_e = length if x_e is None else x_e
    if length < x_e * (1 - 2.0 / N):
        raise NoAnswer(f"the record covers {1e3 * length:.1f} mm; the analysis is over {1e3 * x_e:.1f} mm")
    if len(x) < N:
        raise NoAnswer(f"{len(x)} samples over {1e3 * length:.0f} mm do not fill {N} steps")
    grid = x[0] + x_e * np.arange(N) / N
    order = np.maximum.accumulate(x)  # the encoder may flicker by a count
    y = np.interp(grid, order, e)
    y = y - np.polyval(np.polyfit(grid, y, 1), grid)
    E = _hann(y)
    amplitude = 2.0 * np.abs(E) / HANN_GAIN
    return Spectrum(x_e / np.arange(1, len(E) + 1), E, amplitude, confidence(amplitude)[0], grid - x[0], y)


def peaks(s: Spectrum, R_c: float | None = None, most: int = 12) -> tuple[Peak, ...]:
    """Peaks of a spectrum, longest wavelength first; the capstan radius `R_c` (m) gives their order.

    Raises NoAnswer where no peak exceeds the noise.
    """
    periods = np.zeros(0)
    confidences: list[float] = []
    left, fit = s.e, None
    while len(periods) < most:
        amplitude = 2.0 * np.abs(_hann(left)) / HANN_GAIN
        noise, sure = confidence(amplitude)
        top = int(np.argmax(amplitude / noise))
        close = np.abs(periods - (top + 1)) < 1.0  # residual of a line that is no pure sine
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
    """Origin of each peak of `first` (at `speed` m/s): position, time, either or neither, by `second` (at `other` m/s).

    Raises NoAnswer where the speeds are too alike to separate position from time.
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
    """Peak of the second record at `wavelength`, within the resolution of both records; None without one."""
    best = min(second, key=lambda p: abs(np.log(p.wavelength / wavelength)), default=None)
    if best is None:
        return None
    width = peak.half / peak.wavelength + best.half / best.wavelength + 0.02
    return best if abs(np.log(best.wavelength / wavelength)) < width else None


def confidence(amplitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rayleigh parameter of the noise around every bin, and confidence that a bin is no noise, both (k,).

    The noise is estimated by the median of the surrounding bins without the bin's own line. By the uncertainty of the
    estimate, the ratio r has the tail P = (1 + r^2 / 2 m)^-m of an F distribution; m is the effective number of bins.
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
    periods: np.ndarray  # (n,) periods in the length of the record
    periods_half: np.ndarray  # (n,) half widths of the 95 % intervals
    sin_cos: np.ndarray  # m, (n, 2)
    amplitude_half: np.ndarray  # m, (n,) 95 %
    rest: np.ndarray  # m, (N,), residual


def _sines(s: Spectrum, start: np.ndarray) -> Sines:
    """Sines of free wavelength, fitted together with a new trend by variable projection (Golub & Pereyra 1973)."""
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
    # the residual is smooth: its number of independent samples is its number of sign changes
    independent = max(np.count_nonzero(np.diff(np.sign(r)) != 0) - J.shape[1], 1)
    scale = np.linalg.norm(J, axis=0)
    covariance = np.linalg.pinv((J / scale).T @ (J / scale)) * float(r @ r) / independent
    half = 2.0 * np.sqrt(np.maximum(np.diag(covariance), 0.0)) / scale
    amplitude_half = np.hypot(half[:n], half[n : 2 * n]) / np.sqrt(2.0)
    return Sines(k, half[2 * n + 2 :], np.column_stack((a[:n], a[n : 2 * n])), amplitude_half, r)


def _hann(y: np.ndarray) -> np.ndarray:
    """Fourier transform (N/2,) by (11.10) of `y` (N,) with Hann window, for k = 1 .. N/2."""
    N = len(y)
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(N) / N)
    return np.fft.rfft(window * y)[1:] / N
