"""Change points: shifts and drifts are located; stationary series have none."""

import numpy as np
import pytest

from rtctl.trend.change_points import DRIFT, FEWEST, SHIFT, changes, merged

ONES = np.ones(40)
AT = np.arange(40.0)


def noise(seed: int, n: int = 40, phi: float = 0.0, dof: float = np.inf) -> np.ndarray:
    """Stationary series of unit variance: AR(1) with normal or Student's t innovations."""
    rng = np.random.default_rng(seed)
    e = rng.standard_normal(n) if np.isinf(dof) else rng.standard_t(dof, n)
    x = e.copy()
    for k in range(1, n):
        x[k] = phi * x[k - 1] + np.sqrt(1.0 - phi**2) * e[k]
    return x


def test_shift_is_located_with_its_size() -> None:
    y = noise(1)
    y[25:] += 6.0
    found, probability = changes(y, ONES, AT)
    assert [one.kind for one in found] == [SHIFT] and probability > 0.95
    assert found[0].earliest <= 25 <= found[0].latest and abs(found[0].first - 25) <= 1
    assert found[0].low < 6.0 < found[0].high


def test_shift_and_return_are_two_change_points() -> None:
    y = noise(2, 60)
    y[20:35] += 6.0
    found, _ = changes(y, np.ones(60), np.arange(60.0))
    assert [one.first for one in found] == pytest.approx([20, 35], abs=1)
    assert found[0].size > 0.0 > found[1].size


def test_drift_is_not_a_shift() -> None:
    found, _ = changes(noise(3, 60) + np.linspace(0.0, 9.0, 60), np.ones(60), np.arange(60.0))
    assert [one.kind for one in found] == [DRIFT] and found[0].low < 9.0 < found[0].high


@pytest.mark.parametrize(("phi", "dof"), [(0.0, np.inf), (0.0, 3.0), (0.5, np.inf), (0.9, np.inf)])
def test_stationary_series_rarely_raise_an_alarm(phi: float, dof: float) -> None:
    """The stated false-alarm rate is at most 1 %; benchmarks/trend_alarms.py counts thousands of series."""
    alarms = sum(bool(changes(noise(seed, phi=phi, dof=dof), ONES, AT)[0]) for seed in range(100))
    assert alarms <= 4  # of 100 series at a rate of 1 %: more than 4 have a probability of 0.3 %


def test_single_outlier_is_not_a_change() -> None:
    y = noise(5)
    y[17] += 40.0
    assert changes(y, ONES, AT)[0] == []


def test_change_point_is_invariant_to_unit_and_offset() -> None:
    y = noise(6)
    y[25:] += 5.0
    one, p = changes(y, ONES, AT)
    other, q = changes(1e-7 * y + 3.0, 1e-7 * ONES, 86400.0 * AT)
    assert p == pytest.approx(q, rel=1e-6) and other[0].first == one[0].first
    assert other[0].size == pytest.approx(1e-7 * one[0].size, rel=1e-4)


def test_wide_intervals_lower_the_probability_of_a_change() -> None:
    """A shift of estimates with a large standard error is less probable."""
    y, s = noise(7), ONES.copy()
    y[30:] += 4.0
    s[30:] = 10.0
    assert changes(y, s, AT)[1] < changes(y, ONES, AT)[1]


def test_more_series_lower_the_probability_of_a_change() -> None:
    y = noise(8)
    y[25:] += 3.0
    assert changes(y, ONES, AT, 100)[1] < changes(y, ONES, AT, 1)[1]


def test_short_or_constant_series_have_no_change() -> None:
    assert changes(np.arange(FEWEST - 1.0), ONES[: FEWEST - 1], AT[: FEWEST - 1]) == ([], 0.0)
    assert changes(ONES, ONES, AT) == ([], 0.0)


def test_long_series_are_averaged_in_blocks() -> None:
    y = np.concatenate([np.zeros(700), np.full(300, 2.0)]) + noise(9, 1000)
    mean, s, at, begins = merged(y, np.ones(1000), np.arange(1000.0))
    assert len(mean) == 200 and begins[1] == 5 and s[0] == pytest.approx(5.0**-0.5) and at[0] == pytest.approx(2.0)
    found, _ = changes(y, np.ones(1000), np.arange(1000.0))
    assert found[0].earliest <= 700 <= found[0].latest + 5
