import pytest

from rtctl.laws import integral

DT = 0.001
P = integral.build(integral.IntegralSettings(gain=10.0, dead_zone=0.01, tau_t=0.05), DT)


@pytest.fixture
def s(zero):
    return zero(integral.INTEGRAL_STATE)


def test_integral_holds_within_the_dead_zone_and_grows_beyond_it(s):
    assert integral.step(P, s, 0.009) == 0.0
    assert integral.step(P, s, -0.01) == 0.0
    for _ in range(100):
        u = integral.step(P, s, 0.11)
    assert u == pytest.approx(10.0 * 0.1 * 0.1)
    for _ in range(200):
        u = integral.step(P, s, -0.11)
    assert u == pytest.approx(-10.0 * 0.1 * 0.1)


def test_integral_has_no_jump_at_the_edge_of_the_dead_zone(s):
    assert integral.step(P, s, 0.01 + 1e-9) == pytest.approx(0.0, abs=1e-10)


def test_integral_does_not_wind_up_while_the_output_is_limited(s):
    for _ in range(5000):
        wanted = integral.step(P, s, 1.0)
        integral.track(P, s, wanted, min(wanted, 0.5))
    assert s.i < 0.5 + 10.0 * 1.0 * 0.05 + 0.02  # limit plus the growth within the tracking time


def test_anti_windup_does_not_drive_an_integral_without_gain(s):
    off = integral.build(integral.IntegralSettings(gain=0.0), DT)
    integral.track(off, s, 20.0, 10.0)
    assert integral.step(off, s, 1.0) == 0.0


def test_tracking_time_below_the_tick_is_refused():
    with pytest.raises(ValueError, match="shorter than the tick"):
        integral.build(integral.IntegralSettings(gain=1.0, tau_t=1e-4), DT)


def test_reset_clears_the_integral(s):
    integral.step(P, s, 1.0)
    integral.reset(P, s)
    assert s.i == 0.0
