"""Clock of a recording: equidistant times of a known rate, by one rule for import and for diagnosis.

A time column with few digits is a staircase below an even clock: at 10000 rows a second, three decimals repeat each
time ten times. Two properties identify a staircase: its steps are two neighbouring multiples of the last digit, and it
stays within one digit of an even clock. The rows of a staircase are laid on the even clock.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rtctl.config.errors import UserError

UNEVEN = 0.5  # share of the usual step: largest deviation of one step of an even clock
RATE_OFF = 0.01  # share by which a clock may differ from the given rate
RATE_NOTED = 1e-3  # share from which a note reports the difference
COARSE = 0.01  # share of the usual step: smallest digit that counts as coarse
STAIRS = 8  # irregular steps that show a staircase without a given rate
FITTED = 0.01  # share of a digit: tolerance of the staircase around a fitted rate
ROUNDING = 1e-6  # share of a step within which two steps count as equal


class Clock(NamedTuple):
    t: np.ndarray  # (n,) s; as recorded, or laid on the even clock where its digits are coarse
    rate: float  # Hz
    note: str  # sentence for the user where the column was changed or its rate differs; else empty


def even_rows(
    t: np.ndarray, rate: float | None, row: Callable[[int], str], told: str = "--rate says {:g}", gaps: bool = False
) -> Clock:
    """Clock of the times `t` (n,) in s, n >= 2, finite; `rate` in Hz where it is given.

    `row(k)` names file, column and row k. `told` names the source of the rate `{:g}`. With `gaps`, long steps stay as
    they are. Raises UserError that names the row where time does not increase or a step is missing, and UserError
    where the column has another rate than `rate`.
    """
    stairs = _staircase(t, rate)
    if stairs is not None:
        start, found, digit = stairs
        _agree(found, rate, row, told)
        kept = rate or _tidy(found)
        note = f"time has steps of {digit:.3g} s: the rows are laid on an even clock of {kept:.9g} Hz"
        return Clock(start + np.arange(len(t)) / kept, kept, note + _off(found, rate, told))
    if rate is not None and (np.diff(t) <= 0).any():
        _refuse_break(t, rate, row)
    increasing(t, row, hint=rate is None)
    d = np.diff(t)
    usual = usual_step(d)
    off = np.flatnonzero(np.abs(d - usual) > UNEVEN * usual)
    if len(off) and not gaps:
        k = int(off[0]) + 1
        more = f", as at {len(off) - 1} more places" if len(off) > 1 else ""
        raise UserError(
            f"{row(k)}: {d[k - 1]:.6g} s after the row before where {usual:.6g} s is usual{more}; keep an uneven "
            "clock with --uneven, or resample the rows to an even clock first"
        )
    found = 1.0 / usual
    _agree(found, rate, row, told)
    return Clock(t, rate or _tidy(found), _off(found, rate, told).removeprefix("; "))


def increasing(t: np.ndarray, row: Callable[[int], str], hint: bool = False) -> None:
    """Raise UserError that names the first row not later than the row before; with `hint` it mentions --rate."""
    back = np.flatnonzero(np.diff(t) <= 0)
    if not len(back):
        return
    k = int(back[0]) + 1
    more = f" (also at {len(back) - 1} more rows)" if len(back) > 1 else ""
    ways = "; where its digits are too few, give the rows a second with --rate" if hint else ""
    raise UserError(f"{row(k)}: {t[k]:.9g} s after {t[k - 1]:.9g} s{more}; time should increase{ways}")


def usual_step(d: np.ndarray) -> float:
    """Mean step in s, of the steps `d` (n,) in s near their median; longer steps are gaps."""
    median = float(np.median(d))
    near = d[np.abs(d - median) <= UNEVEN * median]
    return float(np.mean(near))


def _staircase(t: np.ndarray, rate: float | None) -> tuple[float, float, float] | None:
    """Start in s, rate in Hz and digit in s of the even clock above a staircase; None where `t` is no staircase."""
    n = len(t)
    d = np.diff(t)
    mean = float(t[-1] - t[0]) / (n - 1)
    if not mean > 0.0:
        return None
    digit, irregular = _digit(t, d, mean)
    if digit < COARSE * mean:
        return None
    k = np.arange(n, dtype=float)
    # rounding half to even deviates by a whole digit; one lost row does too
    slopes = [(1.0 / rate, 1.0 + (ROUNDING if irregular >= STAIRS else -ROUNDING))] if rate is not None else []
    if irregular >= STAIRS:
        slopes.append((float(np.polyfit(k, t - t[0], 1)[0]), 1.0 + FITTED))
    for slope, share in slopes:
        if not _within(t, slope, digit * share):
            continue
        if rate is None:  # prefer the rate with the fewest digits that explains each step
            short = (1.0 / float(f"{1.0 / slope:.{digits}g}") for digits in range(2, 7))
            slope = next((s for s in short if _within(t, s, digit * (1.0 + ROUNDING))), slope)
        left = t - slope * k
        return 0.5 * float(left.min() + left.max()), 1.0 / slope, digit
    return None


def _within(t: np.ndarray, slope: float, digit: float) -> bool:
    """Whether the times stay within one digit of an even clock with this step in s."""
    left = t - t[0] - slope * np.arange(len(t))
    return float(np.ptp(left)) < digit


def _refuse_break(t: np.ndarray, rate: float, row: Callable[[int], str]) -> None:
    """Raise UserError at the first row where a staircase of few digits leaves the clock of the given rate."""
    d = np.diff(t)
    digit = float(d[d > 0].min()) if (d > 0).any() else 0.0
    if (d < 0).any() or not digit or np.abs(t / digit - np.round(t / digit)).max() > 1e-3:
        return
    left = t - t[0] - np.arange(len(t)) / rate
    band = np.maximum.accumulate(left) - np.minimum.accumulate(left)
    off = np.flatnonzero(band > digit * (1.0 + ROUNDING))
    if len(off) and t[off[0]] - t[0] > STAIRS * digit:
        k = int(off[0])
        raise UserError(
            f"{row(k)}: {t[k]:.9g} s is more than the last digit ({digit:.3g} s) off an even clock of {rate:g} Hz, "
            "which holds up to there: rows are missing or doubled; repair the rows first"
        )


def _digit(t: np.ndarray, d: np.ndarray, mean: float) -> tuple[float, int]:
    """Step of the last digit in s and number of rows that show it; 0 where the column has enough digits."""
    low, high = float(d.min()), float(d.max())
    rounding = max(ROUNDING * mean, 4.0 * float(np.spacing(np.abs(t).max())))
    if low < -rounding or high - low <= rounding:
        return 0.0, 0
    at_low, at_high = np.abs(d - low) <= rounding, np.abs(d - high) <= rounding
    digit = high - low
    if (at_low | at_high).all() and abs(low / digit - round(low / digit)) * digit <= rounding:
        return digit, int(min(at_low.sum(), at_high.sum()))
    with np.errstate(over="ignore"):
        single = t.astype(np.float32)
    if np.array_equal(single.astype(float), t):  # float32 times
        return float(np.spacing(np.abs(single).max())), len(d)
    return 0.0, 0


def _agree(found: float, rate: float | None, row: Callable[[int], str], told: str) -> None:
    if rate is not None and abs(found / rate - 1.0) > RATE_OFF:
        where = row(0).rpartition(", ")[0]
        raise UserError(f"{where} runs at {found:.6g} rows a second where {told.format(rate)}; one is wrong")


def _off(found: float, rate: float | None, told: str) -> str:
    if rate is None or abs(found / rate - 1.0) <= RATE_NOTED:
        return ""
    return f"; time runs at {found:.6g} rows a second and {told.format(rate)}: {rate:g} Hz is taken"


def _tidy(rate: float) -> float:
    """Rate in Hz rounded to five digits where this changes less than 1e-6, the accuracy of any clock here."""
    short = float(f"{rate:.5g}")
    return short if abs(short / rate - 1) < 1e-6 else rate
