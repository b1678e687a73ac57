import numpy as np
import pytest

from rtctl.laws import limit, pi_velocity

DT = 0.001
SETTINGS = pi_velocity.PiVelocitySettings(gain=1000.0, tau_i="50 ms", velocity_gain=20.0, tau_t=0.01)
P = pi_velocity.build(SETTINGS, DT)
LIMIT = limit.build(limit.LimitSettings(high=3.0), DT)


def test_velocity_term_opposes_the_speed(zero):
    p = pi_velocity.build(pi_velocity.PiVelocitySettings(gain=1000.0, velocity_gain=20.0), DT)
    s = zero(pi_velocity.PI_VELOCITY_STATE)
    assert pi_velocity.step(p, s, 1e-3, 0.0) == pytest.approx(1.0)
    assert pi_velocity.step(p, s, 0.0, 0.1) == pytest.approx(-2.0)
    assert s.i == 0.0


def test_integral_equals_the_proportional_part_after_tau_i(zero):
    s = zero(pi_velocity.PI_VELOCITY_STATE)
    for _ in range(50):
        u = pi_velocity.step(P, s, 1e-3, 0.0)
    assert u == pytest.approx(2.0)


def held(s, ticks, track):
    """Integral after a large error during which the output is limited to 3 V."""
    limiter = np.zeros(1, limit.LIMIT_STATE)[0]
    for _ in range(ticks):
        wanted = pi_velocity.step(P, s, 0.01, 0.0)
        written = limit.step(LIMIT, limiter, wanted)
        if track:
            pi_velocity.track(P, s, wanted, written)
    return s.i


def test_tracking_bounds_the_windup_of_the_integral(zero):
    wound = held(zero(pi_velocity.PI_VELOCITY_STATE), 1000, track=False)
    once, twice = (held(zero(pi_velocity.PI_VELOCITY_STATE), n, track=True) for n in (500, 1000))
    assert wound == pytest.approx(200.0)
    assert once == pytest.approx(twice)
    comes_in = P.integral * 0.01
    assert P.tracking * (10.0 + twice + comes_in - 3.0) == pytest.approx(comes_in)


def test_output_leaves_the_limit_when_the_error_changes_sign(zero):
    s = zero(pi_velocity.PI_VELOCITY_STATE)
    held(s, 1000, track=True)
    assert pi_velocity.step(P, s, -1e-3, 0.0) < 3.0
    pi_velocity.reset(P, s)
    assert s.i == 0.0


def test_tracking_does_nothing_without_saturation(zero):
    s = zero(pi_velocity.PI_VELOCITY_STATE)
    u = pi_velocity.step(P, s, 1e-3, 0.0)
    before = s.i
    pi_velocity.track(P, s, u, u)
    assert s.i == before


def test_tracking_time_below_the_tick_is_refused():
    with pytest.raises(ValueError, match=r"tau_t 0\.0001 s is shorter than the tick"):
        pi_velocity.build(SETTINGS.model_copy(update={"tau_t": 1e-4}), DT)
