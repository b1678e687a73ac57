"""Sensitivity by band-limited noise at the plant's input, in closed loop at constant speed.

    S = (W + U_c) / W = 1 / (1 + H_p C)                                          (8.1)
    H_p = (1/S - 1) / C

S is the cross spectrum of noise and command over the spectrum of the noise, averaged as Welch does: Hann window of
4.096 s (2048 samples at 500 Hz, 8192 at 2 kHz), half overlapping, 50 averages. No window spans a turn of the
reference. The coherence says how well S is known, and S how well H_p is:

    var S / |S|^2 = (1 - coh) / (coh n)        sd H_p = sd S / (|S|^2 |C|)

n is the effective number of averages: less the correlation of overlapping windows (Welch 1967: 1/36 for Hann at a
half), and at most the number of windows before the excitation repeats. Leakage between lines repeats with the
excitation, and the coherence does not show it. The bias of the coherence, (1 - coh)^2 / n, is subtracted. The bias of
the window, S'' df^2 / 6, is added to the deviation; it matters at the lowest lines, where S curves. Where S is nearly
1, the loop has little effect and H_p is a small difference with a wide band.

Source: thesis 8.1 and 12.3; Bendat & Piersol, Random Data (2010), chapters 8 (bias) and 9.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer, UserError
from rtctl.design import response
from rtctl.identify.frf import Frf, carried, motor_of, radii
from rtctl.identify.records import Record, check, steady, take_all

WINDOW = 4.096  # s
AVERAGES = 50  # number of windows in the thesis
LEAST = 8  # least number of averages for a coherence
OVERLAP = 1 / 36  # squared correlation of neighbouring Hann windows that overlap by a half
LINES = 1 + 2 * (4 / 9 + 1 / 36)  # variance of a fit over its variance with independent lines, for a Hann window
SETTLE = 1.0  # s after a reversal of the reference


class Sensitivity(NamedTuple):
    f: np.ndarray  # (n,) Hz
    S: np.ndarray  # (n,) complex
    coherence: np.ndarray  # (n,) of excitation and command
    S_sd: np.ndarray  # (n,) standard deviation of S, root of E|dS|^2
    C: np.ndarray  # (n,) complex, feedback of the law, V/rad or V/m
    averages: int
    frf: Frf  # H_p at sufficiently accurate lines


def identify(
    sources: Sequence[Any] | Any, band: tuple[float, float] | None = None, window: float = WINDOW, least: int = LEAST
) -> Sensitivity:
    """Sensitivity and process of one or more records at constant speed with `excitation.kind: noise`.

    Records differ only in the seed of their noise. With `band` in Hz, H_p needs every line of the band; with None it
    holds the sufficiently accurate lines. `window` in s. Raises NoAnswer: record too short, no excitation, drive
    saturated, trip, unstable loop, band too inaccurate; UserError for records of different machines or settings.
    """
    records = take_all(sources)
    first, motor = _together(records)
    stretches = [steady(record, SETTLE) for record in records]
    for record, parts in zip(records, stretches, strict=True):
        check(record, parts)
    n = round(window / first.dt)
    (f, S_ww, S_wu, S_uu), averages, worth = _spectra(records, stretches, n, least)
    noise = first.config.excitation
    keep = (f > 0) & (f >= noise.f_min) & (f <= noise.f_max) & (S_ww > 1e-6 * S_ww.max())
    f, S_ww, S_wu, S_uu = f[keep], S_ww[keep], S_wu[keep], S_uu[keep]
    S = S_wu / S_ww
    coherence = np.abs(S_wu) ** 2 / (S_ww * S_uu)
    sure = np.maximum(coherence - (1 - coherence) ** 2 / worth, 1e-12)  # few averages bias the coherence upwards
    by_noise = np.abs(S) ** 2 * (1 - sure) / (sure * worth)
    S_sd = np.sqrt(by_noise + np.abs(_bend(S) / 6) ** 2)
    C = response.law(first.config, f, motor)
    H = (1 / S - 1) / C
    sd = S_sd / (np.abs(S) ** 2 * np.abs(C))
    R = np.mean([radii(r, _rows(parts)) for r, parts in zip(records, stretches, strict=True)], axis=0)
    frf = Frf(f, H, sd, first.kind, motor, float(R[0]), float(R[1]), first.dt, LINES, False)
    return Sensitivity(f, S, coherence, S_sd, C, averages, _carried(first, frf, S_sd / np.abs(S), coherence, band))


def _together(records: list[Record]) -> tuple[Record, int]:
    """First record and driving motor. Raises UserError for records of different machines or settings."""
    first = records[0]
    for record in records:
        e, law = record.config.excitation, record.config.law
        if e.kind != "noise":
            raise UserError(f"{record.source}: excitation.kind is {e.kind}; this reads records with noise")
        same = e.model_copy(update={"seed": first.config.excitation.seed}) == first.config.excitation
        if record.kind != first.kind or record.dt != first.dt or law != first.config.law or not same:
            raise UserError(f"{record.source}: machine, rate, law and noise but for its seed must be those of "
                            f"{first.source}")  # fmt: skip
    return first, motor_of(first)


def _rows(stretches: list[slice]) -> np.ndarray:
    return np.concatenate([np.arange(s.start, s.stop) for s in stretches] or [np.zeros(0, int)])


def _bend(S: np.ndarray) -> np.ndarray:
    """Second difference of S over its lines; the ends copy their neighbours."""
    if len(S) < 3:
        return np.zeros(len(S))
    inner = np.diff(S, 2)
    return np.concatenate((inner[:1], inner, inner[-1:]))


def _spectra(
    records: list[Record], stretches: list[list[slice]], n: int, least: int
) -> tuple[tuple[np.ndarray, ...], int, float]:
    """f, S_ww, S_wu, S_uu over all stretches, number of windows, and effective number of independent windows."""
    from scipy.signal import csd

    first, hop = records[0], n // 2
    legs = [(r, s) for r, parts in zip(records, stretches, strict=True) for s in parts if s.stop - s.start >= n]
    counts = np.array([(s.stop - s.start - n) // hop + 1 for _, s in legs], int)
    total = int(counts.sum())
    if total < least:
        got = sum(s.stop - s.start for parts in stretches for s in parts) * first.dt
        raise NoAnswer(
            f"{first.source}: too short, {got:.1f} s at constant speed hold {total} windows of {n * first.dt:.3g} s; "
            f"{least} are the least and {AVERAGES} are usual, {n * first.dt * (AVERAGES + 1) / 2:.0f} s"
        )
    sums: list[Any] = [0.0, 0.0, 0.0]
    f = np.zeros(0)
    for (record, s), count in zip(legs, counts, strict=True):
        w, u = record["w"][s], record[record.signals.command][s]
        if not np.any(w):
            raise NoAnswer(
                f"{record.source}: nothing was excited, column 'w' is 0 from {record.t[s.start]:.2f} to "
                f"{record.t[s.stop - 1]:.2f} s"
            )
        for i, (a, b) in enumerate(((w, w), (w, u), (u, u))):
            f, P = csd(a, b, 1 / record.dt, "hann", n, n - hop, detrend="linear")
            sums[i] = sums[i] + count / total * P
    fresh = max(1.0, first.config.excitation.period / (hop * first.dt))  # windows before the noise repeats
    of_each = [sum(int(c) for (r, _), c in zip(legs, counts, strict=True) if r is record) for record in records]
    worth = sum(min(count, fresh) for count in of_each) / (1 + 2 * OVERLAP * (total - 1) / total)
    return (f, sums[0].real, sums[1], sums[2].real), total, worth


def _carried(
    record: Record, frf: Frf, S_relative: np.ndarray, coherence: np.ndarray, band: tuple[float, float] | None
) -> Frf:
    """H_p at sufficiently accurate lines. Where S is uncertain, 1/S - 1 is near -1 for any plant."""
    good = carried(frf.relative) & carried(S_relative)
    if band is None:
        if good.sum() < 5:
            raise NoAnswer(
                f"{record.source}: the coherence is too low from {frf.f[0]:.3g} to {frf.f[-1]:.3g} Hz, the "
                "deviation of H_p is above 50 % everywhere; take more excitation, a longer record or a tighter loop"
            )
        return frf.select(good)
    inside = (frf.f >= band[0]) & (frf.f <= band[1])
    if not inside.any():
        raise NoAnswer(f"{record.source}: nothing was excited from {band[0]:g} to {band[1]:g} Hz")
    bad = np.flatnonzero(inside & ~good)
    if len(bad) > 0.05 * inside.sum():
        raise NoAnswer(
            f"{record.source}: H_p is too inaccurate from {frf.f[bad[0]]:.3g} to {frf.f[bad[-1]]:.3g} Hz: coherence "
            f"down to {coherence[bad].min():.3f}, |S - 1| as small as {_closeness(frf, bad):.2g} of its deviation there"
        )
    return frf.select(inside & good)


def _closeness(frf: Frf, bad: np.ndarray) -> float:
    return float(np.min(1 / frf.relative[bad]))
