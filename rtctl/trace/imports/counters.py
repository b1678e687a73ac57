"""Unwrapping of counters: a wrap is a step beyond half of the modulus where all other steps are smaller.

The modulus is a power of two, or counts per turn given by the user. It lies between the range of the counter and the
range plus one step. Without a modulus in this interval, a note reports the jump and the counter stays unchanged.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

BITS = range(8, 65)
LEAST_RANGE = 16  # counts: in a smaller range a jump cannot be told from a step
REST = 1.25  # share of the largest other step: limit of a wrapped step after unwrapping
AGREES = 0.1  # share of the largest other step: tolerance of an unwrapped step to its neighbours


class Unwrapped(NamedTuple):
    counts: np.ndarray  # (n,)
    note: str  # sentence for the user; empty without a wrap or jump


def unwrapped(name: str, counts: np.ndarray, per_turn: Iterable[float] = ()) -> Unwrapped:
    """Counts (n,) without wraps, and a note; `per_turn` are moduli given by the user."""
    d = np.diff(counts)
    if not len(d):
        return Unwrapped(counts, "")
    span = float(np.ptp(counts))
    jump = np.abs(d) > 0.5 * (span + 1.0)
    if span < LEAST_RANGE or not jump.any() or jump.all():
        return Unwrapped(counts, "")
    step = float(np.abs(d[~jump]).max())
    if not 1.0 <= step < 0.5 * span:
        return Unwrapped(counts, "")
    rows = np.flatnonzero(jump)
    for modulus in (*per_turn, *(2.0**bits for bits in BITS)):
        if not span < modulus <= span + 1.0 + REST * step:
            continue
        rest = d[rows] - np.sign(d[rows]) * modulus
        off = float(np.median(np.abs(rest - _around(d, rows))))
        if np.abs(rest).max() <= REST * step + 1.0 and off <= 1.0 + AGREES * step:
            whole = d.copy()
            whole[rows] = rest
            note = f"{name} wraps at {modulus:.0f} counts: {len(rows)} wraps are taken out"
            return Unwrapped(counts[0] + np.concatenate(([0.0], np.cumsum(whole))), note)
    size = float(np.median(np.abs(d[rows])))
    return Unwrapped(
        counts,
        f"{name} jumps by {size:.0f} counts at row {rows[0] + 1} ({len(rows)} jumps) where all other steps are at most "
        f"{step:.0f}: it was reset, or it wraps at {span + 1:.0f} to {span + 1 + step:.0f} counts; it stays as it is "
        "(--case sensors.NAME_counts_per_rev=... takes wraps at the counts of a turn out)",
    )


def per_turn(case: Mapping[str, Any]) -> list[float]:
    """Counts per turn of the sensors in the case."""
    sensors = case.get("sensors")
    found = sensors.items() if isinstance(sensors, Mapping) else ()
    return [
        float(value)
        for key, value in found
        if str(key).endswith("counts_per_rev") and isinstance(value, int | float) and value > 1
    ]


def _around(d: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Mean of the steps before and after."""
    before, after = np.maximum(rows - 1, 0), np.minimum(rows + 1, len(d) - 1)
    before, after = np.where(rows == 0, after, before), np.where(rows == len(d) - 1, before, after)
    return 0.5 * (d[before] + d[after])
