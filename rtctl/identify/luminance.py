"""Banding of a printed grey image: scanned luminance over position, and its relation to the position error.

Emulation: lines have the nominal distance `pitch` and lie at x_n + e(x_n). Where lines lie closer, they cover more of
the paper:

    a = a_0 pitch / (pitch + e(x_n + lead) - e(x_n)),   Y = Y_paper (1 - a) + Y_ink a,   L* = 116 Y^(1/3) - 16

with `lead` the distance between the nozzles that print neighbouring lines. Ink and paper drift slowly (1/f), and the
scanner averages over its aperture, adds noise and samples.

Analysis: Fourier transforms over position (11.10) of luminance and error; cross spectrum E Gamma as printed, with the
conjugate for its phase; luminance through a band-pass around one wavelength, forwards and backwards.

Source: thesis 11.2, 11.3, figures 11.8 to 11.10; CIE 15 (1976) for L*; Murray & Davies 1936 for the coverage. The
thesis gives neither sizes nor the model from error to luminance; both are chosen.
"""

from typing import NamedTuple

import numpy as np
from pydantic import Field

from rtctl.config.errors import NoAnswer
from rtctl.identify.wavelength import HANN_GAIN, Spectrum, confidence, spectrum
from rtctl.idiom import Settings, quantity

SURE = 0.999


class PrintSettings(Settings):
    """The image and the scanner."""

    pitch: float = quantity(1e-3 / 12, unit="m", gt=0, help="between lines: 1/12 or 1/24 mm")
    lead: float = quantity(2e-3, unit="m", gt=0, help="between the nozzles of neighbouring lines")
    coverage: float = Field(default=0.5, gt=0, lt=1, description="a_0, share of the paper that is inked")
    Y_paper: float = Field(default=0.85, gt=0, le=1, description="luminance of the paper")
    Y_ink: float = Field(default=0.05, ge=0, lt=1, description="luminance of solid ink")
    drift: float = Field(default=0.15, ge=0, description="rms of the slow drift of ink and paper, in L*")
    aperture: float = quantity(1e-3, unit="m", gt=0, help="of the scanner, along the position")
    sample: float = quantity(0.5e-3, unit="m", gt=0, help="between its samples")
    noise: float = Field(default=0.1, ge=0, description="rms noise of a sample, in L*")
    seed: int = Field(default=1, ge=0, description="of drift and noise")


class Image(NamedTuple):
    x: np.ndarray  # m, (n,)
    L: np.ndarray  # L*, (n,)


class Cross(NamedTuple):
    wavelength: np.ndarray  # m, (k,)
    E: np.ndarray  # m, complex (k,)
    Gamma: np.ndarray  # L*, complex (k,)
    S: np.ndarray  # m L*, complex (k,): E Gamma as in the thesis
    phase: np.ndarray  # rad, (k,), lead of the luminance before the error: phase of Gamma conj(E)
    amplitude: np.ndarray  # L*, (k,), amplitude of a sine of the luminance
    confidence: np.ndarray  # (k,) confidence that both exceed the surrounding noise


class Band(NamedTuple):
    x: np.ndarray  # m, (n,)
    L: np.ndarray  # L*, (n,), band-passed
    wavelength: float  # m, mean
    half: float  # m, half width of the 95 % interval of the mean
    amplitude: float  # L*, mean of the envelope
    ripple: float  # relative standard deviation of the envelope


def printed(x: np.ndarray, e: np.ndarray, settings: PrintSettings | None = None) -> Image:
    """Luminance of a grey image printed with the error `e` (m, (n,)) at rising positions `x` (m, (n,)).

    Raises NoAnswer where the record is shorter than a hundred lines, or lines overtake one another.
    """
    s = settings or PrintSettings()
    lines = np.arange(x[0], x[-1] - s.lead, s.pitch)
    if len(lines) < 100:
        raise NoAnswer(f"{1e3 * float(np.ptp(x)):.1f} mm of record give {max(len(lines), 0)} lines; an image takes 100")
    gap = s.pitch + np.interp(lines + s.lead, x, e) - np.interp(lines, x, e)
    if gap.min() <= 0.2 * s.pitch:
        raise NoAnswer(f"lines overtake one another at {1e3 * lines[np.argmin(gap)]:.1f} mm: the error has jumps")
    a = np.minimum(s.coverage * s.pitch / gap, 1.0)
    Y = s.Y_paper * (1.0 - a) + s.Y_ink * a
    rng = np.random.default_rng(s.seed)
    L = 116.0 * np.cbrt(Y) - 16.0 + _pink(len(lines), s.drift, rng)
    width = max(round(s.aperture / s.pitch), 1)
    seen = np.convolve(np.pad(L, width, mode="edge"), np.ones(width) / width, mode="same")[width:-width]
    at = np.arange(lines[0], lines[-1], s.sample)
    return Image(at, np.interp(at, lines, seen) + s.noise * rng.standard_normal(len(at)))


def cross_spectrum(x: np.ndarray, e: np.ndarray, image: Image, N: int = 1000, x_e: float | None = None) -> Cross:
    """Cross spectrum of the error `e` (m) over `x` (m) and the image, over their common range.

    Raises NoAnswer as `spectrum` where the record is too short for `x_e` or `N`.
    """
    begin, end = max(x[0], image.x[0]), min(x[-1], image.x[-1])
    length = (end - begin) if x_e is None else x_e
    both: list[Spectrum] = []
    for at, y in ((x, e), (image.x, image.L)):
        inside = (at >= begin - 1e-12) & (at <= end + 1e-12)
        both.append(spectrum(at[inside], y[inside], min(N, int(inside.sum())), min(length, float(np.ptp(at[inside])))))
    k = min(len(both[0].E), len(both[1].E))
    E, Gamma = both[0].E[:k], both[1].E[:k]
    sure = np.prod([confidence(s.amplitude)[1][:k] for s in both], axis=0)
    phase = np.angle(Gamma * np.conj(E))
    return Cross(both[0].wavelength[:k], E, Gamma, E * Gamma, phase, 2.0 * np.abs(Gamma) / HANN_GAIN, sure)


def shared(cross: Cross) -> list[tuple[float, float, float]]:
    """Wavelength (m), |S| (m L*) and confidence of the common lines of error and luminance, strongest first.

    Lines nearer than two bins are not resolved, such as 150 and 300 mm over 600 mm.

    Raises NoAnswer without a common line.
    """
    size = np.abs(cross.S)
    tops = [k for k in range(len(size)) if cross.confidence[k] > SURE and size[k] == size[max(k - 2, 0) : k + 3].max()]
    if not tops:
        raise NoAnswer("luminance and position error share no wavelength that stands above the noise")
    tops.sort(key=lambda k: -size[k])
    return [(float(cross.wavelength[k]), float(size[k]), float(cross.confidence[k])) for k in tops]


def band_pass(image: Image, longest: float = 20e-3, shortest: float = 17e-3) -> Band:
    """Luminance between two wavelengths (m), second-order Butterworth, forwards and backwards (figure 11.10).

    Wavelength and envelope are those of the analytic signal, without two wavelengths at either end. Raises NoAnswer
    where the image is shorter than eight wavelengths, or where the envelope falls below a fifth: no steady wave then.
    """
    from scipy.signal import butter, hilbert, sosfiltfilt

    dx = float(image.x[1] - image.x[0])
    if np.ptp(image.x) < 8.0 * longest:
        raise NoAnswer(
            f"an image of {1e3 * np.ptp(image.x):.0f} mm is too short for waves of {1e3 * longest:.0f} mm; take 8"
        )
    sos = butter(2, [1.0 / longest, 1.0 / shortest], "bandpass", fs=1.0 / dx, output="sos")
    # padding by six wavelengths, the ringing of the filter, keeps the amplitude at the ends
    L = sosfiltfilt(sos, image.L - image.L.mean(), padlen=min(len(image.L) - 1, round(6.0 * longest / dx)))
    edge = round(2.0 * longest / dx)
    analytic = hilbert(L)[edge:-edge]
    envelope, phase = np.abs(analytic), np.unwrap(np.angle(analytic))
    if envelope.min() < 0.2 * envelope.mean():
        raise NoAnswer(f"no wave of constant size lies between {1e3 * shortest:g} and {1e3 * longest:g} mm")
    at = image.x[edge:-edge]
    (slope, level) = np.polyfit(at, phase, 1)
    rest = phase - (slope * at + level)
    waves = max(float(np.ptp(at)) / longest, 3.0)
    half = 2.0 * float(rest.std()) / np.sqrt(waves) / float(np.std(at))
    wavelength = 2.0 * np.pi / slope
    return Band(
        image.x, L, float(wavelength), float(wavelength * half / slope), float(envelope.mean()),
        float(envelope.std() / envelope.mean()),
    )  # fmt: skip


def _pink(n: int, rms: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of 1/f power and the given rms."""
    if rms == 0.0:
        return np.zeros(n)
    spectrum = rng.standard_normal(n // 2 + 1) + 1j * rng.standard_normal(n // 2 + 1)
    spectrum[0] = 0.0
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    y = np.fft.irfft(spectrum, n)
    return rms * y / y.std()
