"""Margins by python-control, by interpolation and in closed form agree."""

import control
import fused
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer
from rtctl.design import margins, response, systems


def mass(gain: float, tau: float = 0.1, late: float = 3e-3):
    return lambda f: gain * (1 + 2j * np.pi * f * tau) / (2j * np.pi * f) ** 2 * np.exp(-2j * np.pi * f * late)


@settings(deadline=None, max_examples=25)
@given(st.floats(5.0, 400.0), st.floats(0.05, 0.4))
def test_interpolated_margins_agree_with_python_control(gain, tau):
    L = mass(gain, tau)
    exact = margins.margins(L, 0.05, 400)
    f = np.geomspace(0.05, 400, 3000)
    rough = margins.points(f, L(f))
    assert rough.stable == exact.stable
    assert rough.GM == pytest.approx(exact.GM, abs=0.02)
    assert rough.PM == pytest.approx(exact.PM, abs=0.05)
    assert rough.M_S == pytest.approx(exact.M_S, abs=0.02)
    assert rough.bandwidth == pytest.approx(exact.bandwidth, rel=1e-3)


def test_margins_of_a_delayed_double_integrator_agree_with_the_closed_form():
    """The phase is -180 deg at atan(w tau) = w late."""
    m = margins.margins(mass(60.0), 0.05, 400)
    w = 2 * np.pi * m.f_GM
    assert np.arctan(0.1 * w) == pytest.approx(3e-3 * w, rel=1e-4)
    assert m.GM == pytest.approx(-20 * np.log10(abs(mass(60.0)(m.f_GM))), abs=1e-3)
    assert abs(mass(60.0)(m.f_PM)) == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize(("name", "changes"), [
    ("ivu", {}), ("ivu", {"law__position__derivative_filter": None}), ("ldu", {}), ("axis", {}),
    ("ivu", {"law__position__gain": 90.0}), ("ldu", {"law__position__velocity_gain": 260.0}),
])  # fmt: skip
def test_nyquist_criterion_and_poles_agree_on_stability(name, changes):
    config = fused.config(name, **changes)
    assert margins.of_config(config).stable == (np.abs(systems.poles(config)).max() < 1)


def test_sampled_system_has_the_same_margins():
    """python-control on the exact sampled loop, with all its images."""
    config = fused.config("ldu")
    P, K, _ = systems.sampled(config)
    f = margins.refined(lambda f: response.loop(config, f), 0.5, 4990)
    L = (P * K)(np.exp(2j * np.pi * f * P.dt))
    gm, *_ = control.stability_margins((np.abs(L), np.degrees(np.unwrap(np.angle(L))), 2 * np.pi * f))
    assert 20 * np.log10(gm) == pytest.approx(margins.of_config(config).GM, abs=0.05)


@pytest.mark.parametrize("name", ["ivu", "ldu", "axis"])
def test_quick_margins_agree_with_the_full_ones(name):
    slow, quick = (margins.of_config(fused.config(name), quick=q) for q in (False, True))
    np.testing.assert_allclose(quick[1:], slow[1:], rtol=2e-3)


def test_margins_of_the_present_linear_drive_are_those_of_the_thesis():
    """12.7: approximately 8 Hz, and a gain margin of only 2 dB, at the first resonance."""
    m = margins.of_config(fused.config("ldu"))
    assert m.bandwidth == pytest.approx(8.0, rel=0.1)
    assert m.GM == pytest.approx(2.0, abs=0.3)
    assert 100 < m.f_GM < 120


def test_gain_raised_beyond_the_gain_margin_is_unstable():
    config = fused.config("ivu")
    m = margins.of_config(config)
    for dB, stable in ((m.GM - 0.1, True), (m.GM + 0.1, False)):
        more = fused.config("ivu", law__position__gain=31 * 10 ** (dB / 20))
        assert margins.of_config(more).stable == stable
    beyond = margins.of_config(fused.config("ivu", law__position__gain=31 * 10 ** ((m.GM + 3) / 20)))
    assert beyond.GM == pytest.approx(-3.0, abs=0.05)


@pytest.mark.parametrize(("gain", "side"), [(1e-12, "below"), (1e12, "above")])
def test_loop_without_a_crossover_has_no_answer(gain, side):
    f = np.geomspace(1, 100, 200)
    with pytest.raises(NoAnswer, match=f"{side} 1 from 1 to 100 Hz"):
        margins.points(f, mass(gain)(f))


def test_loop_without_a_phase_crossover_has_an_infinite_gain_margin():
    f = np.geomspace(0.01, 100, 500)
    m = margins.points(f, 1 / (2j * np.pi * f))
    assert m.stable and np.isinf(m.GM) and np.isnan(m.f_GM)
    assert pytest.approx(90, abs=0.1) == m.PM
