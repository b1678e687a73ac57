"""Advice to poll the clock (spin), and the recommended duration."""

import pytest

from rtctl.doctor.finding import Finding
from rtctl.doctor.measure import Lateness, Rate
from rtctl.doctor.spin import advice

TWO, ONE = Finding("CPUs", "2 of 2 allowed", "good"), Finding("CPUs", "1 of 2 allowed", "bad")


def rate(hz, p50, p99, p999):
    """A rate with these percentiles, us."""
    return Rate(hz, Lateness(1000, 0, 0, {"p50": p50, "p99": p99, "p999": p999, "max": p999}, None), None)


def test_advised_spin_covers_nearly_all_wakeups():
    found = advice([TWO], [rate(500.0, 13.0, 33.0, 41.0), rate(10_000.0, 12.0, 30.0, 52.0)])
    assert found.hz == 10_000.0
    assert found.seconds == pytest.approx(60e-6)
    assert found.share == pytest.approx(0.6)
    assert "--set loop.spin=60us" in found.sentence


def test_advised_spin_leaves_time_for_the_tick():
    assert advice([TWO], [rate(10_000.0, 20.0, 200.0, 900.0)]).seconds == pytest.approx(80e-6)
    assert advice([TWO], [rate(500.0, 20.0, 200.0, 90_000.0)]).seconds == pytest.approx(1e-3)


def test_spin_is_not_advised_without_a_benefit_or_a_free_cpu():
    assert advice([TWO], [rate(10_000.0, 1.0, 3.0, 4.0)]) is None
    assert advice([ONE], [rate(10_000.0, 12.0, 30.0, 52.0)]) is None
    assert advice([], [rate(10_000.0, 12.0, 30.0, 52.0)]) is None
    assert advice([TWO], []) is None
