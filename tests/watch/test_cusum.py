"""CUSUM: sums rise with a shift and keep the stated false-alarm rate."""

import numpy as np
import pytest

from rtctl.watch.cusum import BOUND, DAY, DRIFT, HIGHEST, Sums, Thresholds, bounded, exponent, thresholds


def test_exponent_of_normal_scores_is_twice_the_drift():
    """For independent normal scores theta is twice the drift (Siegmund 1985, 2.2)."""
    x = np.random.default_rng(0).standard_normal(200_000)
    assert exponent(x, np.ones(len(x))) == pytest.approx(2 * DRIFT, rel=0.05)


def test_exponent_is_smaller_for_correlated_scores():
    rng = np.random.default_rng(1)
    x = np.convolve(rng.standard_normal(50_000), np.ones(4) / 2.0, "same")  # variance 1, correlated over four windows
    assert exponent(x, np.ones(len(x))) < 0.5 * 2 * DRIFT


def test_scores_without_negative_drift_never_reach_the_threshold():
    x = np.full((100, 1), 1.0)
    limits = thresholds(x, np.ones(100), 1.0, 1.0)
    sums = Sums(limits)
    assert all(sums.step(np.array([1.0]), 1.0) is None for _ in range(1000))


def test_false_alarm_rate_of_normal_scores_is_within_the_stated_rate():
    rng = np.random.default_rng(2)
    limits = thresholds(rng.standard_normal((2000, 8)), np.ones(2000), 1.0, per_day=1.0)
    sums, alarms = Sums(limits), 0
    for score in rng.standard_normal((2 * int(DAY), 8)):
        if sums.step(score, 1.0) is not None:
            alarms += 1
            sums.restart()
    assert alarms <= 2


def test_single_outlier_raises_no_alarm_and_a_shift_does():
    sums = Sums(Thresholds(np.array([12.0]), 1.0))
    assert sums.step(np.array([1e9]), 1.0) is None
    assert sums.value[0] == pytest.approx(HIGHEST - DRIFT)
    sums.restart()
    steps = next(n for n in range(100) if sums.step(np.array([2.0]), 1.0) is not None)
    assert steps == int(np.ceil(12.0 / (2.0 - DRIFT))) - 1
    assert sums.rising[0] == steps + 1


def test_window_weight_scales_the_cusum_increment():
    whole, part = (Sums(Thresholds(np.array([12.0]), 1.0)) for _ in range(2))
    whole.step(np.array([2.0]), 1.0)
    part.step(np.array([2.0]), 0.1)
    assert part.value[0] == pytest.approx(0.1 * whole.value[0])


def test_score_limiter_is_monotone_and_symmetric():
    z = np.array([-1e9, -BOUND, -1.0, 0.0, 1.0, BOUND, 2 * BOUND, 1e9])
    found = bounded(z)
    np.testing.assert_allclose(found[1:6], z[1:6])
    assert BOUND < found[6] < 2 * BOUND
    assert found[0] == -HIGHEST and found[7] == HIGHEST
    assert (np.diff(bounded(np.linspace(-20, 20, 500))) >= 0).all()
