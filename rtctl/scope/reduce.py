"""Data reduction for drawing: envelopes that keep every extreme, thinned points, and amplitude spectra."""

from functools import lru_cache

import numpy as np
from scipy.fft import rfft

MOST_POINTS = 4000  # most points of an XY plot
FEWEST, LONGEST_SPECTRUM = 8, 1 << 16  # fewest and most rows of a spectrum


def envelope(values: np.ndarray, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Envelope of an array (signals, n): two arrays (signals, buckets), lowest and highest of each `rows` rows.

    The last bucket may hold fewer rows. NaN is ignored where a bucket has other values.
    """
    if rows == 1 or not values.size:
        return values, values
    whole = values.shape[1] // rows * rows
    parts = values[:, :whole].reshape(len(values), -1, rows)
    low, high = np.fmin.reduce(parts, axis=2), np.fmax.reduce(parts, axis=2)
    if whole < values.shape[1]:
        rest = values[:, whole:]
        low = np.column_stack((low, np.fmin.reduce(rest, axis=1)))
        high = np.column_stack((high, np.fmax.reduce(rest, axis=1)))
    return low, high


def thinned(values: np.ndarray, most: int = MOST_POINTS) -> tuple[np.ndarray, int]:
    """Every n-th row of an array (signals, rows), including the newest, at most `most` rows; and n."""
    step = max(1, -(-values.shape[1] // most))
    return values[:, ::-1][:, ::step][:, ::-1], step


def spectrum(values: np.ndarray, dt: float, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude spectra of an array (signals, rows) that was sampled every `dt` s, without the means.

    Returns frequencies in Hz (points,) and amplitudes (signals, points) in the units of the signals. A sine of
    amplitude 1 reads 1 on a spectral line, and up to 15 % less between two lines (Hann window). Of several lines in a
    column of the logarithmic axis the highest is kept, at the middle of the column. Of more rows the newest 65536 are
    used.

    Source: Heinzel, Ruediger & Schilling, Spectrum and spectral density estimation by the DFT (2002).
    """
    return in_columns(lines(values), min(values.shape[1], LONGEST_SPECTRUM), dt, columns)


def lines(values: np.ndarray) -> np.ndarray:
    """Squared amplitudes (signals, lines) of an array (signals, rows), from the first frequency above zero on.

    The transform is in single precision, which takes a third of the time. Mean and scale are removed before, so only
    lines some 140 dB below the signal are lost.
    """
    values = values[:, -LONGEST_SPECTRUM:]
    if values.shape[1] < FEWEST:
        return np.empty((len(values), 0))
    window, scale = _hann(values.shape[1])
    short, largest = np.empty(values.shape, np.float32), np.empty((len(values), 1))
    for k, signal in enumerate(values):  # one by one, to stay in the CPU cache
        moved = signal - signal.mean()
        largest[k] = max(moved.max(), -moved.min()) or 1.0
        moved *= window
        np.divide(moved, largest[k], out=short[k], casting="same_kind")
    found = rfft(short, overwrite_x=True)[:, 1:]  # all at once, for vector instructions
    return (found.real**2 + found.imag**2) * (scale * largest**2)


def in_columns(squared: np.ndarray, rows: int, dt: float, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (points,) and amplitudes (signals, points), as in `spectrum`, from the `lines` of `rows` rows."""
    if rows < FEWEST:
        return np.empty(0), np.empty((len(squared), 0))
    frequency, begins = _columns(rows, dt, columns)
    return frequency, np.sqrt(squared if begins is None else np.maximum.reduceat(squared, begins, axis=1))


@lru_cache(maxsize=4)
def _hann(n: int) -> tuple[np.ndarray, float]:
    """Hann window (n,), and the factor from squared lines to squared amplitudes."""
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    return window, (2.0 / window.sum()) ** 2


@lru_cache(maxsize=8)
def _columns(n: int, dt: float, columns: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Frequencies of the columns, Hz, and the first line of each; None where each line has its own column."""
    frequency = np.fft.rfftfreq(n, dt)[1:]
    if len(frequency) <= columns:
        return frequency, None
    column = (np.log(frequency / frequency[0]) / np.log(frequency[-1] / frequency[0]) * (columns - 1)).astype(int)
    begins = np.flatnonzero(np.diff(column, prepend=-1))
    ends = np.append(begins[1:], len(frequency)) - 1
    return np.sqrt(frequency[begins] * frequency[ends]), begins
