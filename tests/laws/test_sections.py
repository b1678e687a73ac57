import numpy as np
import pytest
from pydantic import ValidationError

from rtctl.laws import biquad, low_pass, notch, sections

DT = 1e-4
LEAD_LAG = {"kind": "lead_lag", "k": 1.7e5, "alpha": 0.05, "tau_I": 2.22, "beta": 10.0, "tau_D": 3.5e-3}
NOTCH = {"kind": "notch", "frequency": "119 Hz", "zeta_z": 0.05, "zeta_p": 0.5}
LOW_PASS = {"kind": "low_pass", "frequency": "250 Hz"}


def build(*chosen):
    return sections.build(sections.SectionsSettings(sections=list(chosen)), DT)


def run(p, s, x):
    return np.array([sections.step(p, s, float(xk)) for xk in x])


X = np.random.default_rng(3).standard_normal(100)


def test_empty_cascade_passes_its_input(zero):
    assert np.array_equal(run(build(), zero(sections.SECTIONS_STATE), X), X)


def test_cascade_applies_its_sections_in_order(zero, record):
    p = build(NOTCH, LOW_PASS)
    one, two = zero(biquad.BIQUAD_STATE), zero(biquad.BIQUAD_STATE)
    first = notch.build(notch.NotchSettings(**NOTCH), DT)
    second = low_pass.build(low_pass.LowPassSettings(**LOW_PASS), DT)
    wanted = [biquad.step(second, two, biquad.step(first, one, float(x))) for x in X]
    assert np.array_equal(run(p, zero(sections.SECTIONS_STATE), X), wanted)
    assert np.array_equal(run(record(p), zero(sections.SECTIONS_STATE), X), wanted)


def test_five_coefficients_are_a_section():
    raw = [392874.03618895734, -392245.3689983912, 0.0, -0.8817652051165021, 0.0]
    assert list(build(raw).first) == raw


def test_reset_cascade_is_in_steady_state(zero):
    p, s = build(LEAD_LAG, NOTCH, NOTCH, LOW_PASS), zero(sections.SECTIONS_STATE)
    y = sections.reset(p, s, 1e-6)
    assert y == pytest.approx(0.17, rel=1e-6)
    assert run(p, s, [1e-6] * 10) == pytest.approx([y] * 10, rel=1e-6)


def test_error_names_the_invalid_section():
    with pytest.raises(ValueError, match=r"section 2 \(notch\): zeta_z 0.6 is not below"):
        build(LOW_PASS, {**NOTCH, "zeta_z": 0.6})


@pytest.mark.parametrize("bad", [[[1.0, 2.0]], [{"kind": "notsch"}], [NOTCH] * 5, [{**NOTCH, "depth": 3}]])
def test_invalid_section_is_refused(bad):
    with pytest.raises(ValidationError):
        sections.SectionsSettings(sections=bad)
