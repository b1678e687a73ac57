"""Seconds from a column of any type: dates and durations carry their unit, integers are subtracted exactly."""

import numpy as np

SPACING = 1e-4  # share of a step: coarsest spacing of doubles at which a clock keeps its zero


def is_date(values: np.ndarray) -> bool:
    """True for time stamps (datetime64) and durations (timedelta64)."""
    return values.dtype.kind in "Mm"


def seconds(values: np.ndarray, factor: float) -> np.ndarray:
    """Times (n,) in s as doubles.

    `values` (n,) are datetime64 or timedelta64 without NaT, or finite numbers in units of `factor` s. Time stamps are
    counted from the first row. Integers keep their zero unless doubles would be too coarse for their steps.
    """
    if not len(values):
        return np.empty(0)
    if is_date(values):
        ticks = values - values[0]
        one = np.array(1, ticks.dtype)
        per_second = float(np.timedelta64(1, "s") / one)
        whole = ticks.astype(np.int64)  # division is exact: 15e9 ns / 1e9 are 15 s, 15e9 * 1e-9 s are not
        return whole / per_second if per_second >= 1.0 else whole * float(one / np.timedelta64(1, "s"))
    if values.dtype.kind in "iu" and len(values) > 1:
        first = values[0]
        below = values < first  # unsigned integers wrap
        ticks = np.where(below, -(first - values).astype(np.float64), (values - first).astype(np.float64))
        steps = np.abs(np.diff(ticks))
        if float(np.spacing(abs(float(first)))) * factor > SPACING * factor * float(np.median(steps)) or (
            float(np.spacing(abs(float(first)) * factor)) > SPACING * factor * float(np.median(steps))
        ):
            return ticks * factor
    found = values.astype(np.float64)
    return found if factor == 1.0 else found * factor
