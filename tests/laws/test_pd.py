import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.laws import pd

DT = 0.002
P = pd.build(pd.PdSettings(gain=6.2, tau_d=0.16, derivative_filter=80.0), DT)


def run(p, s, errors):
    return np.array([pd.step(p, s, float(e)) for e in errors])


def test_pd_design_gives_the_gains_of_the_thesis():
    gain, tau_d = pd.design(K_p=25.4, w_n=4 * np.pi, zeta=1.0)
    assert gain == pytest.approx(6.2, rel=0.01)
    assert tau_d == pytest.approx(0.16, rel=0.01)


def test_pd_design_refuses_a_negative_process_gain():
    with pytest.raises(ValueError, match="positive"):
        pd.design(K_p=-25.4, w_n=12.0)


def test_first_step_has_no_derivative_kick(zero):
    s = zero(pd.PD_STATE)
    assert pd.step(P, s, 1.0) == pytest.approx(6.2)
    pd.step(P, s, 2.0)
    pd.reset(P, s)
    assert pd.step(P, s, -1.0) == pytest.approx(-6.2)


def test_pd_is_the_law_of_the_exchange_format(zero, record):
    rng = np.random.default_rng(1)
    e = rng.standard_normal(50)
    a = 1 - np.exp(-2 * np.pi * 80.0 * DT)
    d, wanted = 0.0, []
    for k, now in enumerate(e):
        d += a * ((now - e[max(k - 1, 0)]) / DT - d)
        wanted.append(6.2 * now + 6.2 * 0.16 * d)
    assert run(P, zero(pd.PD_STATE), e) == pytest.approx(wanted, rel=1e-12)
    assert np.array_equal(run(record(P), zero(pd.PD_STATE), e), run(P, zero(pd.PD_STATE), e))


@pytest.mark.parametrize("f", [1.0, 5.0, 10.0])
def test_frequency_response_matches_the_continuous_pd_with_half_a_tick_of_lag(zero, f):
    t = np.arange(4000) * DT
    u = run(P, zero(pd.PD_STATE), np.sin(2 * np.pi * f * t))
    tail = slice(2000, None)  # an integer number of periods of every f
    measured = 2j * np.mean(u[tail] * np.exp(-2j * np.pi * f * t[tail]))
    w = 2 * np.pi * f
    filtered = 1j * w * np.exp(-0.5j * w * DT) / (1 + 1j * w / (2 * np.pi * 80))
    assert measured == pytest.approx(6.2 * (1 + 0.16 * filtered), rel=0.06)


@settings(deadline=None)
@given(st.lists(st.floats(-10, 10), min_size=1, max_size=20))
def test_pd_is_odd_in_the_error(errors):
    there, back = np.zeros(2, pd.PD_STATE)
    e = np.array(errors)
    assert np.array_equal(run(P, there, e), -run(P, back, -e))


def test_unfiltered_derivative_is_the_slope_of_a_ramp_at_once(zero):
    p = pd.build(pd.PdSettings(gain=2.0, tau_d=0.5), DT)
    s = zero(pd.PD_STATE)
    run(p, s, [0.0, 3.0 * DT])
    assert s.d == pytest.approx(3.0)


def test_missed_ticks_do_not_multiply_the_derivative(zero):
    s, slope = zero(pd.PD_STATE), 0.5
    before = run(P, s, slope * np.arange(500) * DT)[-1]
    after = pd.step(P, s, slope * 507 * DT, 8)
    assert after == pytest.approx(before + P.gain * slope * 8 * DT, rel=1e-6)


def test_pd_gain_units_follow_the_machine():
    assert pd.PdMetreSettings(gain="5 V/mm").gain == pytest.approx(5000.0)
    assert pd.PdSettings(gain=1.0, tau_d="160 ms").tau_d == pytest.approx(0.16)
    with pytest.raises(ValidationError):
        pd.PdSettings(gain="5 V/mm")


def test_exchange_format_gains_may_be_derivative_only(zero):
    s = zero(pd.PD_STATE)
    p = pd.of_gains(0.0, 0.5, None, DT)
    assert list(run(p, s, [0.0, 3.0 * DT])) == pytest.approx([0.0, 1.5])
