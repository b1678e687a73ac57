"""Error table of the encoder's position: the error periodic in the capstan's turn, from a scale or a printed image.

    e = x - x_hat = a + b x_hat + sum of c_h cos(2 pi h x_hat / period) + d_h sin(...)     h = 1..H      (11.8), (11.11)

over `period` = 2 pi R_c_hat, exactly a turn of the encoder whatever the true radius is. The trend a + b x_hat is the
error of the capstan's mean radius and belongs into R_c (`trend`); the sum goes into the table. A harmonic enters only
where its amplitude is above the noise floor, the amplitudes that a fit of orders between the harmonics gives.

From luminance only the first harmonic is taken: the band of figure 11.10 blocks all others. The gain from error to
luminance, with its phase, must come from a record that has both (`luminance_gain`).

Source: thesis 11.3, (11.11), (11.12), figure 11.10 (second-order Butterworth from 1/20 to 1/17 per mm, both ways).
"""

from typing import NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.laws.error_table import ErrorTableSettings

POINTS = 64  # values a turn: a straight line between them misses the third harmonic by 1 %
HARMONICS = 4
LEAST_TURNS = 3.0
SURE = 3.0  # times the floor
BAND = (17e-3, 20e-3)  # m, of figure 11.10


class Table(NamedTuple):
    """Error table with the harmonics, noise floor and trend of its record."""

    settings: ErrorTableSettings
    amplitude: np.ndarray  # (H,) m, of each harmonic
    floor: float  # m, noise floor: amplitude between the harmonics
    trend: float  # m/m: R_c is (1 + trend) R_c_hat
    turns: float  # of the capstan in the record


def from_scale(
    position: np.ndarray, error: np.ndarray, period: float, harmonics: int = HARMONICS, points: int = POINTS
) -> Table:
    """Table from the scale: `error` = scale - position (n,) m at the encoder's `position` (n,) m.

    `period` in m is 2 pi R_c of the config. Raises NoAnswer where the record has fewer than three turns, leaves out
    a part of the turn, or shows no error that comes back every turn.
    """
    position, error = np.asarray(position, float), np.asarray(error, float)
    turns = float(np.ptp(position)) / period
    if turns < LEAST_TURNS:
        raise NoAnswer(f"the record covers {turns:.2g} turns of the capstan; a table takes {LEAST_TURNS:g}")
    filled = np.histogram(position % period, bins=points, range=(0, period))[0]
    if not filled.all():
        gap = (int(np.argmin(filled)) + 0.5) * period / points
        raise NoAnswer(f"no sample near {1e3 * gap:.3g} mm of the turn; record at constant speed")
    orders = np.arange(1, harmonics + 1)
    between = orders - 0.5
    fit = _fit(position, error, period, np.concatenate([orders, between]))
    amplitude, floor = np.abs(fit[2][:harmonics]), float(np.sqrt(np.mean(np.abs(fit[2][harmonics:]) ** 2)))
    kept = amplitude > SURE * floor
    if not kept.any():
        raise NoAnswer(
            f"nothing comes back every turn: {1e6 * amplitude.max():.2g} um once in {1e3 * period:.3g} mm or a part of "
            f"it, {1e6 * floor:.2g} um where there should be none"
        )
    c = np.where(kept, fit[2][:harmonics], 0)
    return Table(_table(c, orders, period, points), amplitude, floor, float(fit[1]), turns)


def from_luminance(
    position: np.ndarray, luminance: np.ndarray, period: float, gain: complex, points: int = POINTS
) -> Table:
    """Table from the luminance (n,) of a grey image over the `position` (n,) m, evenly spaced.

    `gain` is luminance over error at this wavelength, per m, with its phase. Raises NoAnswer where the image has fewer
    than eight turns (its ends are lost to the filter), or the turn does not stand out in it.
    """
    wave, rest, turns = _filtered(position, luminance, period)
    c = _fit(position[rest], wave[rest], period, np.array([1.0, 0.95, 1.05]))[2]
    amplitude, floor = abs(c[0]), float(np.max(np.abs(c[1:])))
    if amplitude < SURE * floor:
        raise NoAnswer(
            f"a wave of {1e3 * period:.4g} mm does not stand out in the luminance: {amplitude:.2g} against {floor:.2g} "
            "at its neighbours"
        )
    error = np.array([c[0] / gain])
    return Table(_table(error, np.array([1.0]), period, points), np.abs(error), floor / abs(gain), float("nan"), turns)


def luminance_gain(position: np.ndarray, luminance: np.ndarray, error: np.ndarray, period: float) -> complex:
    """Luminance over error at one turn of the capstan, per m with its phase, from a record (n,) that has both.

    Raises NoAnswer as `from_luminance`.
    """
    wave, rest, _ = _filtered(position, luminance, period)
    known, _, _ = _filtered(position, error, period)
    one = np.array([1.0])
    seen, there = (_fit(position[rest], y[rest], period, one)[2][0] for y in (wave, known))
    return complex(seen / there)


def periodic(position: np.ndarray, error: np.ndarray, period: float, harmonics: int = HARMONICS) -> float:
    """Rms in m of the part of the error (n,) m that is periodic in the turn."""
    c = _fit(np.asarray(position, float), np.asarray(error, float), period, np.arange(1.0, harmonics + 1))[2]
    return float(np.sqrt(np.sum(np.abs(c) ** 2) / 2))


def _fit(x: np.ndarray, y: np.ndarray, period: float, orders: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Level, slope and complex amplitudes c of y = a + b x + Re sum of c exp(j 2 pi h x / period), least squares."""
    turn = np.exp(2j * np.pi * np.outer(x / period, orders))
    columns = np.hstack([np.ones((len(x), 1)), x[:, None], turn.real, -turn.imag])
    found = np.linalg.lstsq(columns, y, rcond=None)[0]
    k = len(orders)
    return float(found[0]), float(found[1]), found[2 : 2 + k] + 1j * found[2 + k :]


def _table(c: np.ndarray, orders: np.ndarray, period: float, points: int) -> ErrorTableSettings:
    angle = 2j * np.pi * np.outer(np.arange(points) / points, orders)
    values = np.real(np.exp(angle) @ c)
    return ErrorTableSettings(period=period, values=[float(f"{v:.4g}") for v in values])


def _filtered(position: np.ndarray, y: np.ndarray, period: float) -> tuple[np.ndarray, slice, float]:
    """Band-pass of `y` around the turn, without the transients at the ends, and its number of turns."""
    from scipy.signal import butter, sosfiltfilt  # slow to import, and needed here only

    steps = np.diff(position)
    turns = float(np.ptp(position)) / period
    if turns < 8:
        raise NoAnswer(f"the image covers {turns:.2g} turns of the capstan; the filter takes 8")
    if np.ptp(steps) > 1e-3 * abs(steps.mean()):
        raise NoAnswer("the positions are not evenly spaced; interpolate the luminance first")
    scale = period / 18.85e-3  # the band belongs to a capstan of 3 mm
    sos = butter(2, [1 / (BAND[1] * scale), 1 / (BAND[0] * scale)], "bandpass", fs=1 / abs(steps.mean()), output="sos")
    edge = round(2 * period / abs(steps.mean()))
    return sosfiltfilt(sos, y - np.mean(y)), slice(edge, -edge), turns
