"""Histograms of times in ns, counted inside the tick and read outside it.

Log-linear buckets, 32 per octave: a percentile is accurate to 3 % from nanoseconds to minutes. Adding a value takes a
few instructions.

Source: the bucket layout of HdrHistogram (G. Tene).
"""

import math
from typing import Any

import numpy as np

from rtctl.idiom import state, tick

SUB = 32  # buckets per octave
BUCKETS = SUB * 33  # buckets, up to 2^37 ns, two minutes
HISTOGRAM = state(count=int, max=int, bucket=(int, BUCKETS))


@tick
def add(h, ns):
    """Count one time of `ns` nanoseconds; negative times count as zero."""
    value = max(ns, 0)
    h.count += 1
    h.max = max(h.max, value)
    h.bucket[_index(value)] += 1


@tick
def _index(value):
    if value < SUB:
        return value
    exponent = math.frexp(float(value))[1]  # value = m 2^exponent with m in [0.5, 1)
    octave = exponent - 6  # value >> octave lies in [32, 64)
    return min(SUB * octave + (value >> octave), BUCKETS - 1)


def percentiles(h: np.void) -> dict[str, float]:
    """p50, p99, p999 and max in microseconds; zeros where nothing was counted."""
    count = int(h["count"])
    if count == 0:
        return {"p50": 0.0, "p99": 0.0, "p999": 0.0, "max": 0.0}
    cumulative = np.cumsum(h["bucket"])
    out = {}
    for name, share in (("p50", 0.5), ("p99", 0.99), ("p999", 0.999)):
        index = int(np.searchsorted(cumulative, share * count))
        out[name] = round(min(_middle(index), float(h["max"])) / 1000.0, 3)
    out["max"] = round(float(h["max"]) / 1000.0, 3)
    return out


def _middle(index: int) -> float:
    if index < SUB:
        return float(index)
    octave = index // SUB - 1
    return (index - SUB * octave + 0.5) * 2.0**octave


def octaves(h: np.void) -> list[tuple[int, int]]:
    """Cumulative counts: pairs of 2^k ns and the number of shorter times, from 64 ns to the octave of the longest."""
    cumulative = np.cumsum(h["bucket"])
    longest = max(int(h["max"]), 64).bit_length()
    return [(1 << k, int(cumulative[SUB * (k - 4) - 1])) for k in range(6, min(longest, 36) + 1)]


def total(h: np.void) -> float:
    """Sum of all times, ns, to the resolution of the buckets."""
    counted = np.flatnonzero(h["bucket"])
    return float(sum(_middle(int(i)) * int(h["bucket"][i]) for i in counted))


def account(h: np.void) -> dict[str, Any]:
    """Histogram for JSON: count, percentiles and max in us, and non-empty buckets as pairs (middle in ns, count)."""
    counted = np.flatnonzero(h["bucket"])
    return {
        "count": int(h["count"]),
        **percentiles(h),
        "buckets": [[_middle(int(i)), int(h["bucket"][i])] for i in counted],
    }
