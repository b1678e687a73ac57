import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import shaper

DT = 0.002


def run(target, bandwidth=8.0):
    p = shaper.build(shaper.ShaperSettings(bandwidth=bandwidth), DT)
    s = np.zeros(1, shaper.SHAPER_STATE)[0]
    rows = [(shaper.step(p, s, x), s["speed"], s["acceleration"]) for x in target]
    return np.array(rows)


def test_shaped_step_reaches_the_target_without_overshoot():
    ref = run(np.ones(1500))[:, 0]
    assert ref.max() <= 1.0
    assert np.all(np.diff(ref) >= 0.0)
    assert ref[round(11 / 8.0 / DT)] == pytest.approx(1.0, abs=2e-3)


def test_shaper_speed_and_acceleration_are_derivatives_of_its_output():
    ref, speed, acceleration = run(np.ones(1500)).T
    np.testing.assert_allclose(np.gradient(ref, DT)[5:-5], speed[5:-5], atol=0.02 * speed.max())
    np.testing.assert_allclose(np.gradient(speed, DT)[5:-5], acceleration[5:-5], atol=0.05 * acceleration.max())


def test_shaped_step_has_a_bounded_acceleration():
    assert np.abs(run(np.ones(1500))[:, 2]).max() <= 0.24 * 8.0**2


def test_shaper_without_a_bandwidth_passes_the_target():
    target = np.sin(np.arange(50))
    np.testing.assert_allclose(run(target, None)[:, 0], target, atol=1e-12)


def test_reset_shaper_is_at_rest():
    p = shaper.build(shaper.ShaperSettings(bandwidth=8.0), DT)
    s = np.zeros(1, shaper.SHAPER_STATE)[0]
    shaper.step(p, s, 5.0)
    shaper.reset(p, s, 2.0)
    assert shaper.step(p, s, 2.0) == 2.0
    assert s["speed"] == 0.0 and s["acceleration"] == 0.0


@settings(deadline=None)
@given(st.lists(st.floats(-10, 10), min_size=1, max_size=50))
def test_shaper_output_stays_within_the_range_of_its_targets(targets):
    ref = run(np.repeat(targets, 20))[:, 0]
    assert ref.max() <= max(0.0, *targets) + 1e-12
    assert ref.min() >= min(0.0, *targets) - 1e-12


def test_shaper_recovers_speed_and_acceleration_from_its_output(zero):
    p = shaper.build(shaper.ShaperSettings(bandwidth=60.0), 1e-4)
    made, again = zero(shaper.SHAPER_STATE), zero(shaper.SHAPER_STATE)
    for k in range(2000):
        shaper.follow(p, again, shaper.step(p, made, 0.01 if k > 5 else 0.0))
    assert made.acceleration != 0.0
    assert again.acceleration == pytest.approx(made.acceleration, rel=1e-6)
    assert again.speed == pytest.approx(made.speed, rel=1e-9)


def test_without_a_shaper_what_follows_has_no_speed(zero):
    p, s = shaper.build(shaper.ShaperSettings(), 1e-4), zero(shaper.SHAPER_STATE)
    shaper.follow(p, s, 1.0)
    assert (s.ref, s.speed, s.acceleration) == (1.0, 0.0, 0.0)
