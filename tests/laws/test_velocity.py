import numpy as np
import pytest

from rtctl.laws import velocity

DT = 0.002


def run(p, s, x):
    return np.array([velocity.step(p, s, float(xk)) for xk in x])


def test_velocity_of_a_ramp_converges_to_its_slope(zero):
    p = velocity.build(velocity.VelocitySettings(filter=20.0), DT)
    v = run(p, zero(velocity.VELOCITY_STATE), 5.0 + 3.0 * np.arange(300) * DT)
    assert v[0] == 0.0
    assert v[-1] == pytest.approx(3.0, rel=1e-6)
    assert np.all(np.diff(v) >= -1e-9)


def test_unfiltered_velocity_is_the_difference_quotient(zero):
    p = velocity.build(velocity.VelocitySettings(), DT)
    assert run(p, zero(velocity.VELOCITY_STATE), [1.0, 1.0, 1.01, 1.0]) == pytest.approx([0, 0, 5.0, -5.0])


def test_filter_attenuates_the_velocity_step_of_one_count(zero):
    p = velocity.build(velocity.VelocitySettings(filter=10.0), DT)
    count = 2 * np.pi / 10_000
    v = run(p, zero(velocity.VELOCITY_STATE), np.where(np.arange(50) < 10, 0.0, count))
    assert v.max() == pytest.approx(p.a * count / DT)


@pytest.mark.parametrize("filter_hz", [None, 20.0])
def test_speed_of_a_ramp_is_kept_over_missed_ticks(zero, filter_hz):
    p = velocity.build(velocity.VelocitySettings(filter=filter_hz), DT)
    s = zero(velocity.VELOCITY_STATE)
    before = run(p, s, 3.0 * np.arange(300) * DT)[-1]
    assert velocity.step(p, s, 3.0 * 307 * DT, 8) == pytest.approx(before, rel=1e-6)


def test_reset_clears_the_last_position(zero):
    p = velocity.build(velocity.VelocitySettings(filter=10.0), DT)
    s = zero(velocity.VELOCITY_STATE)
    run(p, s, [0.0, 1.0])
    velocity.reset(p, s)
    assert velocity.step(p, s, 7.0) == 0.0
