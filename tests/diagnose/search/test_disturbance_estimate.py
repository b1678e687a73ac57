"""Orders, positions and jumps in signals with known content."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose.search.disturbance_estimate import MOST, ORDERS, Along, jumps, orders_of, peaks, spectrum, spots


def turning(n=6000, turns=3.0, seed=0):
    """Angle (n,) in rad of a reciprocating motion at variable speed."""
    t = np.linspace(0, 1, n)
    return turns * 2 * np.pi * (0.5 - 0.5 * np.cos(2 * np.pi * 2 * t)) + 0.3 * np.sin(2 * np.pi * 5 * t)


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([1.0, 2.0, 5.0, 7.0, 13.0, 28.0]), st.floats(-3.1, 3.1), st.integers(0, 1000))
def test_ripple_order_is_found_under_drift_friction_and_noise(order, phase, seed):
    angle = turning()
    rng = np.random.default_rng(seed)
    signal = np.cos(order * angle + phase) + 0.7 * rng.standard_normal(len(angle))
    signal += 2.0 + 0.1 * angle + 1.5 * np.sign(np.gradient(angle))
    found = orders_of(float(np.ptp(angle)), spectrum(Along(angle), signal, ORDERS), MOST)
    assert found[0] == order


def test_less_than_a_turn_does_not_separate_adjacent_orders():
    angle = turning(turns=0.4)
    found = orders_of(float(np.ptp(angle)), spectrum(Along(angle), np.cos(6 * angle), ORDERS), MOST)
    assert 6.0 in found
    assert {found[0] - 1.0, found[0] + 1.0} <= set(found)


def test_spectrum_is_a_share_of_the_variance():
    angle = turning()
    share = spectrum(Along(angle), np.cos(3 * angle), np.array([3.0, 7.0]))
    assert share[0] == pytest.approx(1.0, abs=1e-6)
    assert 0.0 <= share[1] < 0.2


def test_orders_with_less_than_half_a_period_have_no_share():
    angle = np.linspace(0, 1.0, 500)
    share = spectrum(Along(angle), np.cos(angle), np.array([0.5, 2.0, 4.0]))
    assert (share[:2] == 0.0).all()
    assert share[2] > 0.0


def test_zero_signal_has_no_peaks():
    angle = turning()
    assert peaks(ORDERS, spectrum(Along(angle), np.zeros(len(angle)), ORDERS), MOST) == []


def test_peaks_are_sorted_by_height():
    height = np.array([0, 1, 0, 3, 0, 2, 0, 0.5, 0, 0])
    assert peaks(np.arange(10.0), height, 3) == [3.0, 5.0, 1.0]


@settings(deadline=None, max_examples=20)
@given(st.floats(0.1, 0.9), st.sampled_from([-1.0, 1.0]))
def test_bump_position_is_found_beside_a_slope(where, sign):
    way = 0.05 * (1 - np.cos(np.linspace(0, 12 * np.pi, 8000)))
    at = 0.1 * where
    signal = sign * np.exp(-0.5 * ((way - at) / 1.5e-3) ** 2) + 5.0 * way
    signal += 0.05 * np.random.default_rng(0).standard_normal(len(way))
    assert spots(way, signal, 4)[0] == pytest.approx(where, abs=0.025)
    assert len(spots(way, signal, 3)) == 3


def test_permanent_jumps_are_found_in_order_of_size():
    rng = np.random.default_rng(0)
    error = 0.3 * rng.standard_normal(4000)
    error[1500:] += 20.0
    error[3000:] -= 60.0
    error[2200] += 40.0  # single outlier
    found = jumps(error, 1.0)
    assert [k for k, _ in found] == [3000, 1500]
    assert [size for _, size in found] == pytest.approx([-60.0, 20.0], abs=1.0)


def test_repeated_weak_jumps_are_found_with_a_common_size():
    rng = np.random.default_rng(2)
    error = 0.7 * rng.standard_normal(8000)
    for k in range(500, 8000, 500):
        error[k:] += 7.0 if k % 1000 else -7.0
    found = jumps(error, 1.0)
    assert {k for k, _ in found} <= set(range(500, 8000, 500)) and len(found) >= 14
    sizes = [abs(size) for _, size in found]
    assert max(sizes) - min(sizes) < 1e-9 and sizes[0] == pytest.approx(7.0, abs=0.3)
    weak = 0.7 * rng.standard_normal(8000)
    weak[4000:] += 4.5
    assert jumps(weak, 1.0) == []  # a single weak jump may be noise


def test_transient_oscillation_is_not_a_jump():
    """A ringing error exceeds the record, but not the adjacent ticks."""
    error = 0.2 * np.random.default_rng(0).standard_normal(4000)
    error[2000:2060] += 30.0 * np.sin(np.arange(60) * 0.5)
    assert jumps(error, 1.0) == []


def test_two_close_jumps_are_separate():
    error = np.random.default_rng(3).normal(0.0, 0.3, 1000)
    error[500:] += 33.0
    error[502:] += 33.0
    assert sorted(k for k, _ in jumps(error, 1.0)) == [500, 502]
    error[504:] += 33.0  # three close jumps are a motion
    assert jumps(error, 1.0) == []


def test_noise_has_no_jumps():
    error = 0.5 * np.random.default_rng(1).standard_normal(4000)
    assert jumps(error, 1.0) == []
