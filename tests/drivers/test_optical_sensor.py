import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import optical_sensor as sensor

SETTINGS = sensor.OpticalSensorSettings()
P = sensor.build(SETTINGS, 0.002)
PERIOD = 2 * math.pi / 209


def counts(path, p=P):
    s = np.zeros(1, sensor.OPTICAL_SENSOR_STATE)[0]
    return [sensor.count(p, s, sensor.volts(p, float(theta))) for theta in path]


def test_sensor_has_209_periods_per_turn_with_half_of_each_light():
    v = np.array([sensor.volts(P, theta) for theta in np.linspace(0, 2 * math.pi, 100_001)])
    assert v.min() == 0 and v.max() == 5
    assert np.mean(v > 2.5) == pytest.approx(0.5, abs=1e-3)
    assert counts(np.linspace(0, 2 * math.pi, 4001))[-1] == 209


@settings(deadline=None)
@given(st.lists(st.integers(-30, 30), max_size=12), st.floats(0.05, 0.95))
def test_sensor_counts_travel_in_both_directions(legs, phase):
    """Legs of full periods with reversals in a dark stretch: one count per period of |travel|."""
    p = sensor.build(sensor.OpticalSensorSettings(phase=phase), 0.002)
    at, path = -phase * PERIOD, []
    for leg in legs:
        path += list(np.linspace(at, at + leg * PERIOD, abs(leg) * 8 + 1))
        at += leg * PERIOD
    last = counts(path, p)[-1] if path else 0
    assert last == sum(abs(leg) for leg in legs)


@settings(deadline=None)
@given(st.lists(st.floats(2.0, 5.0), max_size=50), st.lists(st.floats(0.0, 3.0), max_size=50))
def test_noise_that_does_not_cross_both_levels_is_not_counted(light, dark):
    s = np.zeros(1, sensor.OPTICAL_SENSOR_STATE)[0]
    assert [sensor.count(P, s, v) for v in (0.0, 3.5, *light, 1.0, *dark)][-1] == 1


@settings(deadline=None, max_examples=30)
@given(st.floats(0, 1), st.sampled_from((1, -1)))
def test_sensor_counts_every_edge_up_to_the_highest_speed(start, sign):
    dt, n = 0.002, 2000
    for times, misses in ((0.999, False), (2.3, True)):
        step = sign * times * sensor.highest_speed(SETTINGS, dt) * dt
        last = counts(start * PERIOD + step * np.arange(n + 1))[-1]
        assert (abs(last - n * abs(step) / PERIOD) > 2) == misses


def test_first_sample_sets_the_level_without_a_count():
    light = PERIOD / 2
    assert counts([light, light, 0.0, light]) == [0, 0, 0, 1]
    assert sensor.radians(P, 209) == pytest.approx(2 * math.pi)


def test_highest_speed_agrees_with_the_docstring():
    assert sensor.highest_speed(SETTINGS, 0.002) == pytest.approx(7.2, abs=0.05)


def test_crossed_levels_are_refused():
    with pytest.raises(ValueError, match="must lie below"):
        sensor.build(sensor.OpticalSensorSettings(low=3.0, high=2.0), 0.002)
