"""Stability margins of a loop: gain and phase margin, bandwidth, peak of the sensitivity.

    S = 1 / (1 + L)        T = P H K_ref / (1 + L)

`margins` takes the loop as a function of frequency, so that the grid can be made fine where the loop crosses |L| = 1
and the negative real axis; python-control computes the margins on this grid. `points` takes a loop that is known at
some frequencies only, such as a measured loop, and interpolates log |L| and phase; it uses numpy alone, so it is fast
enough for an optimiser. The two functions agree on loops that both can take.

Stability is judged by the encirclements of the origin by 1 + L, for loops without an open-loop pole in the right half
plane.

Source: Astrom & Murray, Feedback Systems (2008), 9.2-9.3 (Nyquist, margins, s_m = 1 / max |S|).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import NoAnswer
from rtctl.design import response

Response = Callable[[np.ndarray], np.ndarray]  # frequencies (n,) Hz to a complex response (n,)
COARSE, FINE = 1500, 40  # points of the grid, and further points around every crossing
LOW, HIGH = 0.05, 0.499  # Hz, and part of the sample rate
HALF_POWER = np.sqrt(0.5)


class Margins(NamedTuple):
    """Margins of a loop. Without a crossing the margin is infinite and its frequency nan."""

    stable: bool
    GM: float  # dB by which the gain may change, nearest crossing of -180 degrees; negative where it must fall
    f_GM: float  # Hz
    PM: float  # deg, smallest at any crossing of |L| = 1
    f_PM: float  # Hz, that crossing
    M_S: float  # dB, largest |S|
    f_S: float  # Hz
    bandwidth: float  # Hz, where |T| first falls below -3 dB


def of_config(config: Any, motor: int = 1, printed: bool = False, quick: bool = False) -> Margins:
    """Margins of a config's sampled loop; `printed` takes the law as the thesis prints it, with a pure delay.

    `quick` interpolates on the refined grid instead of calling python-control: equal results, twenty times as fast.
    Raises NoAnswer where the loop crosses nothing between 0.05 Hz and half the sample rate.
    """
    parts = response.take(config, motor)
    high = HIGH / parts.dt
    L, forward = loops(parts, printed)
    if quick:
        f = refined(L, LOW, high)
        return points(f, L(f), forward(f))
    return margins(L, LOW, high, forward)


def loops(parts: response.Loop, printed: bool = False) -> tuple[Response, Response]:
    """Loop gain, and gain from reference to position with the loop open, as functions of frequency."""

    def P(f: np.ndarray) -> np.ndarray:
        return response.plant_response(parts.model, f) * (1 if printed else response.hold(parts, f))

    if printed:
        return (lambda f: P(f) * response.printed_law(parts, f),) * 2
    return (
        lambda f: P(f) * response.law_response(parts, f),
        lambda f: P(f) * response.law_response(parts, f, "reference"),
    )


def margins(L: Response, low: float, high: float, forward: Response | None = None) -> Margins:
    """Margins of the loop `L` between `low` and `high` Hz, by python-control on a grid refined at every crossing.

    `forward` is the gain from reference to position with the loop open, L itself if absent.
    Raises NoAnswer where |L| stays on one side of 1.
    """
    import control  # takes a second to import

    f = refined(L, low, high)
    values = L(f)
    known = points(f, values, None if forward is None else forward(f))
    phase = np.degrees(np.unwrap(np.angle(values)))
    gm, _, sm, w_pc, _, w_ms = control.stability_margins((np.abs(values), phase, 2 * np.pi * f), returnall=True)
    all_gm = np.abs(20 * np.log10(np.atleast_1d(gm))) if np.size(gm) else np.zeros(0)
    if all_gm.size:
        nearest = int(np.argmin(all_gm))
        known = known._replace(
            GM=float(20 * np.log10(np.atleast_1d(gm)[nearest])), f_GM=float(np.atleast_1d(w_pc)[nearest]) / (2 * np.pi)
        )
    if np.size(sm):
        least = int(np.argmin(sm))
        known = known._replace(
            M_S=float(-20 * np.log10(np.atleast_1d(sm)[least])), f_S=float(np.atleast_1d(w_ms)[least]) / (2 * np.pi)
        )
    return known


def refined(L: Response, low: float, high: float) -> np.ndarray:
    """Frequencies in Hz from `low` to `high`: evenly in the logarithm, and closer where L crosses |L| = 1 or -180."""
    f = np.geomspace(low, high, COARSE)
    for _ in range(2):
        values = L(f)
        found = np.union1d(_unity(values), _negative(values))
        peak = int(np.argmin(np.abs(1 + values)))
        found = np.union1d(found, [max(peak - 1, 0), min(peak, len(f) - 2)])
        extra = [np.geomspace(f[i], f[i + 1], FINE)[1:-1] for i in found]
        f = np.unique(np.concatenate([f, *extra]))
    return f


def points(f: np.ndarray, L: np.ndarray, forward: np.ndarray | None = None) -> Margins:
    """Margins of a loop `L` (n,) known at the frequencies `f` (n,) Hz, rising; between them it is interpolated.

    Raises NoAnswer where |L| stays on one side of 1: there is no crossover to judge.
    """
    log_f, log_L, phase = np.log(f), np.log(np.abs(L)), np.unwrap(np.angle(L))
    unity, negative = _unity(L), _negative(L)
    if not unity.size:
        side = "below" if log_L[0] < 0 else "above"
        raise NoAnswer(f"the loop gain stays {side} 1 from {f[0]:g} to {f[-1]:g} Hz; there is no crossover to judge")
    share = log_L[unity] / (log_L[unity] - log_L[unity + 1])
    at = np.exp(log_f[unity] + share * np.diff(log_f)[unity])
    pm = 180 + np.degrees(phase[unity] + share * np.diff(phase)[unity])
    pm = (pm + 180) % 360 - 180
    worst = int(np.argmin(np.abs(pm)))
    GM, f_GM = np.inf, np.nan
    if negative.size:
        turn = (phase[negative] + np.pi) / (2 * np.pi)
        whole = np.round((turn + (phase[negative + 1] + np.pi) / (2 * np.pi)) / 2)
        share_n = (whole - turn) * 2 * np.pi / np.diff(phase)[negative]
        gains = -20 / np.log(10) * (log_L[negative] + share_n * np.diff(log_L)[negative])
        nearest = int(np.argmin(np.abs(gains)))
        GM = gains[nearest]
        f_GM = np.exp(log_f[negative] + share_n * np.diff(log_f)[negative])[nearest]
    S = 1 / np.abs(1 + L)
    peak = int(np.argmax(S))
    T = np.abs(L if forward is None else forward) * S
    return Margins(
        stable(f, L), float(GM), float(f_GM), float(pm[worst]), float(at[worst]),
        float(20 * np.log10(S[peak])), float(f[peak]), _falls(log_f, T),
    )  # fmt: skip


def stable(f: np.ndarray, L: np.ndarray) -> bool:
    """Whether the closed loop is stable, by encirclements of 1 + L. L is (n,) at the rising frequencies `f` (n,) Hz.

    The open loop may have poles at 0, for which `f[0]` must be low enough, and none in the right half plane.
    """
    slope = np.log(np.abs(L[1] / L[0])) / np.log(f[1] / f[0])
    start = np.angle(1 + L[0])
    poles = max(round(-slope), 0) if np.abs(L[0]) > 3 else 0
    start += 2 * np.pi * np.round((-poles * np.pi / 2 - start) / (2 * np.pi))
    end = start + np.sum(np.angle((1 + L[1:]) / (1 + L[:-1])))
    return bool(abs(end) < np.pi)


def _unity(L: np.ndarray) -> np.ndarray:
    """Indices after which |L| crosses 1."""
    above = np.abs(L) > 1
    return np.flatnonzero(above[1:] != above[:-1])


def _negative(L: np.ndarray) -> np.ndarray:
    """Indices after which L crosses the negative real axis."""
    phase = np.unwrap(np.angle(L))
    turns = np.floor((phase + np.pi) / (2 * np.pi))
    return np.flatnonzero(turns[1:] != turns[:-1])


def _falls(log_f: np.ndarray, T: np.ndarray) -> float:
    """Frequency in Hz where |T| first falls below -3 dB for good in this band; nan where it does not."""
    below = np.flatnonzero((T[1:] < HALF_POWER) & (T[:-1] >= HALF_POWER))
    if not below.size:
        return float("nan")
    i = below[0]
    share = np.log(HALF_POWER / T[i]) / np.log(T[i + 1] / T[i])
    return float(np.exp(log_f[i] + share * (log_f[i + 1] - log_f[i])))
