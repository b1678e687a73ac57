"""Binned means of a missing force or reading along an axis, and knots of hat functions."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import t

LEAST = 12  # samples in a bin, at least
GAP = 0.25  # of the axis: smallest gap across which no line is drawn


def binned(
    x: np.ndarray, y: np.ndarray, law: np.ndarray, count: int, block: int, middle: Callable[..., Any] = np.median
) -> np.ndarray:
    """Binned curve (4, bins) along x: centres, `middle` (the median) of y, half widths of the 95 % bands, and
    `middle` of the law.

    Neighbouring samples are not independent: the band comes from the scatter of the means of `block` rows, visit by
    visit. The share of the range of x plus the share of the samples is equal for all bins; a gap in x gives a column of
    nan. No samples give no bins.
    """
    if not len(x):
        return np.empty((4, 0))
    lo, hi = np.quantile(x, (0.002, 0.998))
    edges = spaced(np.sort(x[(x >= lo) & (x <= hi)]), lo, hi, count + 1)
    index = np.searchsorted(edges, x) - 1
    out: list[tuple[float, ...]] = []
    for k in range(len(edges) - 1):
        here = np.flatnonzero(index == k)
        visits, number = np.unique(here // block, return_inverse=True)
        if len(here) >= LEAST and len(visits) > 2:
            means = np.bincount(number, y[here]) / np.bincount(number)
            half = float(t.ppf(0.975, len(visits) - 1) * np.std(means, ddof=1) / np.sqrt(len(visits)))
            at = float(np.median(x[here]))
            if out and at - out[-1][0] > GAP * (hi - lo):
                out.append((np.nan,) * 4)
            out.append((at, float(middle(y[here])), half, float(middle(law[here]))))
    return np.array(out, float).reshape(-1, 4).T


def spaced(values: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """Knots (count,) among sorted values (n,): the share of the range plus the share of the values is equal for all
    steps."""
    share = 0.5 * ((values - low) / ((high - low) or 1.0) + np.linspace(0.0, 1.0, len(values)))
    return np.interp(np.linspace(0.0, 1.0, count), share, values)
