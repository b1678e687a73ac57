"""Cumulative sums of bounded scores, with thresholds for a stated rate of false alarms.

A score is the deviation of a window from the healthy machine in standard deviations. Scores are bounded, so that no
single window makes an alarm. Each sum falls by DRIFT a window, rises by the score, and is never below zero.

Source: Page, Continuous inspection schemes, Biometrika 41 (1954); Siegmund, Sequential Analysis (1985), ch. 2: the
mean time between false alarms grows as exp(theta h), where theta is the positive root of E exp(theta (score - drift))
= 1. For correlated scores theta is computed with the variance of long sums.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

DRIFT = 0.6  # standard deviations: half the least shift that the sums are designed for
BOUND = 4.0  # standard deviations, beyond which a score counts by its logarithm
TAIL = 2.0  # standard deviations for each factor e beyond BOUND
HIGHEST = 9.0  # standard deviations, of a score: no window alone makes an alarm
MARGIN = 1.5  # factor of the thresholds, for tails that a short learned sample does not show
LONG = 16  # windows of the sums by which the correlation of scores is measured
MOST = 2.0  # upper bound of theta: no learned sample is long enough for a steeper tail
DAY = 8 * 3600.0  # s of motion


class Thresholds(NamedTuple):
    """Thresholds (scores,) of the sums, and their rate of false alarms."""

    h: np.ndarray
    per_day: float  # false alarms in eight hours of motion, at most, by theory


def bounded(scores: np.ndarray) -> np.ndarray:
    """Bounded scores; beyond BOUND logarithmic, so that a large effect in a few windows is noticed too."""
    size = np.abs(scores)
    tail = BOUND + TAIL * np.log(np.maximum(size, BOUND) / BOUND)
    return np.copysign(np.where(size < BOUND, size, np.minimum(tail, HIGHEST)), scores)


def exponent(scores: np.ndarray, weights: np.ndarray) -> float:
    """Exponent theta by which the probability of a false alarm falls with the threshold, for scores (n,) of a healthy
    machine and their weights (n,).

    The smaller of two estimates: from the distribution of single scores, and from the variance of long sums. Zero where
    the mean of score less drift is not negative.
    """
    x = weights * (bounded(scores) - DRIFT)
    if x.mean() >= 0.0:
        return 0.0
    if x.max() <= 0.0:
        return MOST

    def excess(theta: float) -> float:
        return float(np.log(np.mean(np.exp(theta * x))))

    single = brentq(excess, 1e-6, MOST) if excess(MOST) > 0.0 and excess(1e-6) < 0.0 else MOST
    long = min(LONG, len(x) // 4)
    if long < 2:
        return min(single, 2.0 * DRIFT)
    total = np.convolve(x, np.ones(long), "valid")
    spread = max(float(np.var(total)) / long, float(np.var(x)))
    return float(min(single, -2.0 * x.mean() / spread, MOST))


def thresholds(scores: np.ndarray, weights: np.ndarray, seconds: float, per_day: float) -> Thresholds:
    """Thresholds for scores (n, k) and weights (n,) of a healthy machine in windows of `seconds`.

    All sums together make at most `per_day` false alarms in eight hours of motion.
    """
    windows = DAY / seconds
    odds = np.log(windows * scores.shape[1] / per_day)
    theta = np.array([exponent(column, weights) for column in scores.T])
    return Thresholds(MARGIN * odds / np.maximum(theta, 1e-3), per_day)


class Sums:
    """Cumulative sums (k,) of k scores."""

    def __init__(self, limits: Thresholds):
        self.limits = limits
        self.restart()

    def restart(self) -> None:
        """Begin at zero."""
        self.value = np.zeros(len(self.limits.h))
        self.rising = np.zeros(len(self.limits.h), int)  # windows since each was zero

    @property
    def share(self) -> np.ndarray:
        """Shares (k,) of the thresholds that are reached."""
        return np.asarray(self.value / self.limits.h)

    def step(self, score: np.ndarray, weight: float) -> int | None:
        """Take in the scores (k,) of a window and its weight.

        Returns the number of the sum that is furthest beyond its threshold, None where none is.
        """
        self.value = np.maximum(self.value + weight * (bounded(score) - DRIFT), 0.0)
        self.rising = np.where(self.value > 0.0, self.rising + 1, 0)
        share = self.share
        top = int(np.argmax(share))
        return top if share[top] >= 1.0 else None
