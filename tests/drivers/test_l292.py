import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import l292

S = l292.L292Settings()
P = l292.build(S, 0.002)


def response(system, f):
    A, B, C = system
    return np.array([C @ np.linalg.solve(2j * np.pi * x * np.eye(2) - A, B) for x in f])


def test_ten_volts_give_two_amperes():
    A, B, C = l292.state_space(S)
    assert C @ np.linalg.solve(-A, B) == pytest.approx(0.2)
    assert abs(l292.transfer_function(S, np.array([1e-3]))[0]) == pytest.approx(0.2)


def test_damping_and_bandwidth_are_those_of_the_thesis():
    gain, w_0, zeta = l292.second_order(S)
    assert gain == pytest.approx(0.2)
    assert zeta == pytest.approx(math.sqrt(0.5), rel=0.01)
    assert w_0 / (2 * math.pi) == pytest.approx(2.12e3, rel=0.01)
    assert 1 / (2 * math.pi * S.R_F * S.C_F) == pytest.approx(3e3, rel=0.01)
    assert l292.cutoff(S) == pytest.approx(2.7e3, rel=0.01)
    at = l292.transfer_function(S, np.array([l292.cutoff(S)]))
    assert abs(at[0]) == pytest.approx(0.2 * math.sqrt(0.5), rel=2e-3)


def test_two_states_are_equation_7_1_with_the_pole_cancelled():
    f = np.logspace(0, 5, 50)
    exact = S.model_copy(update={"L_M": S.R * S.C * S.R_M})
    assert response(l292.state_space(exact), f) == pytest.approx(l292.transfer_function(exact, f), rel=1e-9)
    np.testing.assert_allclose(response(l292.state_space(S), f), l292.transfer_function(S, f), rtol=2e-3)


def test_motor_with_an_uncancelled_pole_is_refused():
    with pytest.raises(ValueError, match=r"choose R = 1\.31e\+05 ohm"):
        l292.build(S.model_copy(update={"L_M": 0.05}), 0.002)


@settings(deadline=None)
@given(st.floats(allow_nan=True))
def test_current_command_is_limited(volts):
    limited = l292.limit(P, volts)
    assert abs(0.2 * limited) <= 2.0 + 1e-12
    assert limited == volts or abs(volts) > 10 or math.isnan(volts)


def test_supply_voltage_limits_the_current():
    p = l292.build(S.model_copy(update={"supply_limit": True}), 0.002)
    assert 0.2 * p.volts_max == pytest.approx(24 / 58)


def test_chopping_at_22_khz_has_a_small_ripple():
    assert l292.f_osc(S) == pytest.approx(22e3, rel=0.02)
    assert l292.ripple(S) == pytest.approx(24 / (4 * 65e-3 * 22.2e3), rel=0.01)
    assert l292.build(S.model_copy(update={"ripple": True}), 0.002).ripple == l292.ripple(S)
    assert P.ripple == 0.0


@settings(deadline=None)
@given(st.floats(1e-6, 1e-3), st.integers(1, 30))
def test_mean_ripple_does_not_depend_on_the_step_size(h, pieces):
    p = P._replace(ripple=1.0)
    whole, cut = np.zeros(1, l292.RIPPLE_STATE)[0], np.zeros(1, l292.RIPPLE_STATE)[0]
    mean = np.mean([l292.ripple_step(p, cut, h / pieces) for _ in range(pieces)])
    assert mean == pytest.approx(l292.ripple_step(p, whole, h), abs=1e-9)
    assert abs(mean) <= 1.0


def test_ripple_is_a_triangle_with_zero_mean():
    p, s = P._replace(ripple=1.0), np.zeros(1, l292.RIPPLE_STATE)[0]
    x = np.array([l292.ripple_step(p, s, 1 / (1000 * P.f_osc)) for _ in range(1000)])
    assert x.mean() == pytest.approx(0, abs=1e-9)
    assert x.min() == pytest.approx(-1, abs=0.01) and x.max() == pytest.approx(1, abs=0.01)
