"""Excitation: a periodic waveform added to the controller's output, for identification.

    none        nothing
    noise       band-limited, Gaussian, periodic
    prbs        pseudo-random binary, +-amplitude, the longest sequence that fits the period
    multisine   odd lines of equal size and random phase; even lines are left out and show even non-linearity
    sine        one frequency, moved to the nearest that fits the waveform a whole number of times

The waveform is made once at build, with the seed given, and played from memory: the same seed gives the same bits.

Source: thesis 8.1 and 12.3 (band-limited noise); Pintelon & Schoukens, System Identification (2012), section 4.3.
"""

from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field

from rtctl.idiom import Settings, quantity, tick

MOST = 65536  # samples in a period
FOREVER = 2**62  # ticks


class _Timed(Settings):
    start: float = quantity(0.0, unit="s", ge=0, help="when it begins")
    stop: float | None = quantity(None, unit="s", gt=0, help="when it ends; never if absent")


class _Periodic(_Timed):
    period: float = quantity(4.0, unit="s", gt=0, help="length of the waveform, at most 65536 ticks")
    seed: int = Field(default=1, ge=0, description="another seed gives another waveform")


class _Band(_Periodic):
    rms: float = quantity(unit="V", gt=0, help="effective value")
    f_min: float = quantity(0.0, unit="Hz", ge=0, help="lowest frequency")
    f_max: float = quantity(unit="Hz", gt=0, help="highest frequency")


class NoneSettings(_Timed):
    kind: Literal["none"] = "none"


class NoiseSettings(_Band):
    kind: Literal["noise"] = "noise"


class MultisineSettings(_Band):
    kind: Literal["multisine"] = "multisine"


class PrbsSettings(_Periodic):
    kind: Literal["prbs"] = "prbs"
    amplitude: float = quantity(unit="V", gt=0, help="size of both levels")
    hold: int = Field(default=1, ge=1, description="ticks per bit; the spectrum is flat to a third of 1/(hold dt)")


class SineSettings(_Timed):
    kind: Literal["sine"] = "sine"
    amplitude: float = quantity(unit="V", gt=0, help="peak value")
    frequency: float = quantity(unit="Hz", gt=0, help="frequency")


ExcitationSettings = Annotated[
    NoneSettings | NoiseSettings | PrbsSettings | MultisineSettings | SineSettings, Field(discriminator="kind")
]


class ExcitationParams(NamedTuple):
    x: np.ndarray  # waveform of unit rms or peak, (MOST,)
    n: int  # samples in a period
    amplitude: float  # V
    start: int  # first tick
    stop: int  # first tick without it


def build(settings: ExcitationSettings, dt: float) -> ExcitationParams:
    """Waveform for a tick of `dt` s. Raises ValueError where the period or the band does not fit the sample rate."""
    amplitude = 0.0
    if isinstance(settings, NoneSettings):
        x = np.zeros(1)
    elif isinstance(settings, SineSettings):
        x, amplitude = _sine(settings.frequency, dt), settings.amplitude
    elif isinstance(settings, PrbsSettings):
        x, amplitude = _prbs(_samples(settings, dt), settings), settings.amplitude
    else:
        x, amplitude = _lines(_samples(settings, dt), settings, dt), settings.rms
    waveform = np.zeros(MOST)
    waveform[: len(x)] = x
    stop = FOREVER if settings.stop is None else round(settings.stop / dt)
    return ExcitationParams(waveform, len(x), amplitude, round(settings.start / dt), stop)


def _samples(settings: _Periodic, dt: float) -> int:
    n = round(settings.period / dt)
    if not 2 <= n <= MOST:
        raise ValueError(f"a period of {settings.period:g} s takes {n} samples; {MOST} are the most, {MOST * dt:g} s")
    return n


def _lines(n: int, settings: NoiseSettings | MultisineSettings, dt: float) -> np.ndarray:
    """Noise or multisine of unit rms from its spectrum, hence periodic in `n` samples."""
    if settings.f_max * dt >= 0.5:
        raise ValueError(f"f_max {settings.f_max:g} Hz is not below half the sample rate of {1 / dt:g} Hz")
    rng = np.random.default_rng(settings.seed)
    lines = np.arange(n // 2 + 1)
    used = (lines > 0) & (lines >= settings.f_min * n * dt - 1e-9) & (lines <= settings.f_max * n * dt + 1e-9)
    if settings.kind == "multisine":
        used &= lines % 2 == 1
        spectrum = np.exp(2j * np.pi * rng.random(len(lines)))
    else:
        spectrum = rng.standard_normal(len(lines)) + 1j * rng.standard_normal(len(lines))
    if not used.any():
        raise ValueError(
            f"no line of a {settings.period:g} s period lies from {settings.f_min:g} to {settings.f_max:g} Hz; "
            "take a longer period or a wider band"
        )
    x = np.fft.irfft(np.where(used, spectrum, 0.0), n)
    return x / np.sqrt(np.mean(x**2))


def _prbs(n: int, settings: PrbsSettings) -> np.ndarray:
    from scipy.signal import max_len_seq  # slow to import, and needed here only

    order = int(np.log2(n // settings.hold + 1))
    if order < 3:
        raise ValueError(f"a period of {n} ticks has no room for a sequence of bits of {settings.hold} ticks")
    bits = 2.0 * max_len_seq(order)[0] - 1.0
    shift = np.random.default_rng(settings.seed).integers(len(bits))  # every phase of the sequence is as good
    return np.repeat(np.roll(bits, shift), settings.hold)


def _sine(frequency: float, dt: float) -> np.ndarray:
    """As many whole periods as fit, in the number of samples that comes nearest to the frequency."""
    if frequency * dt >= 0.5 or frequency * dt * MOST < 1:
        raise ValueError(
            f"{frequency:g} Hz is not between {1 / (MOST * dt):g} and {0.5 / dt:g} Hz, the range at this rate"
        )
    cycles = np.arange(1, int(MOST * frequency * dt) + 1)
    samples = np.round(cycles / (frequency * dt))
    fits = samples <= MOST
    best = np.argmin(np.abs(cycles[fits] / samples[fits] - frequency * dt))
    n = int(samples[best])
    return np.sin(2 * np.pi * cycles[best] * np.arange(n) / n)


@tick
def step(p, k):
    """Excitation in V at tick `k`."""
    if k < p.start or k >= p.stop:
        return 0.0
    return p.amplitude * p.x[(k - p.start) % p.n]
