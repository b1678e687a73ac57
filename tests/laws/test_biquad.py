import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from rtctl.laws import biquad

DT = 1e-4
P = biquad.BiquadParams(0.9542029613663944, -1.8820007660787637, 0.9330658666124224, -1.8820007660787637, 0.8872688)


def run(p, s, x):
    return np.array([biquad.step(p, s, float(xk)) for xk in x])


def test_biquad_is_bit_exact_with_the_exchange_format(zero, record):
    x = np.random.default_rng(2).standard_normal(200)
    y = np.zeros(200)
    for k in range(200):
        x1, x2 = (x[k - 1] if k > 0 else 0.0), (x[k - 2] if k > 1 else 0.0)
        y1, y2 = (y[k - 1] if k > 0 else 0.0), (y[k - 2] if k > 1 else 0.0)
        y[k] = P.b0 * x[k] + P.b1 * x1 + P.b2 * x2 - P.a1 * y1 - P.a2 * y2
    assert np.array_equal(run(P, zero(biquad.BIQUAD_STATE), x), y)
    assert np.array_equal(run(record(P), zero(biquad.BIQUAD_STATE), x), y)
    assert y == pytest.approx(lfilter(P[:3], [1.0, *P[3:]], x), abs=1e-9)


@pytest.mark.parametrize("f", [1.0, 10.0, 100.0])
def test_bilinear_transform_matches_the_continuous_filter_below_nyquist(response, f):
    num, den = [3.0, 40.0], [1e-4, 0.02, 1.0]
    s = 2j * np.pi * f
    assert response(biquad.bilinear2(num, den, DT), f, DT) == pytest.approx(
        np.polyval(num, s) / np.polyval(den, s), rel=2e-3
    )


@settings(deadline=None)
@given(st.floats(1.0, 4900.0))
def test_prewarping_is_exact_at_one_frequency(f):
    w = 2 * np.pi * f
    p = biquad.bilinear2([w * w], [1.0, 1.4 * w, w * w], DT, prewarp=w)
    z = np.exp(-1j * w * DT)
    assert (p.b0 + p.b1 * z + p.b2 * z * z) / (1 + p.a1 * z + p.a2 * z * z) == pytest.approx(1 / 1.4j, rel=1e-6)


def test_first_order_section_has_no_cancelling_pair_at_nyquist():
    p = biquad.bilinear2([1.0], [0.01, 1.0], DT)
    assert p.b2 == p.a2 == 0.0


@pytest.mark.parametrize("x", [0.0, 2.5, -1e3])
def test_reset_biquad_is_in_steady_state(zero, x):
    s = zero(biquad.BIQUAD_STATE)
    y = biquad.reset(P, s, x)
    assert y == pytest.approx(sum(P[:3]) / (1 + P.a1 + P.a2) * x)
    assert run(P, s, [x] * 20) == pytest.approx([y] * 20, rel=1e-9)


def test_reset_of_an_integrator_starts_at_zero(zero):
    s = zero(biquad.BIQUAD_STATE)
    p = biquad.BiquadParams(DT, 0.0, 0.0, -1.0, 0.0)
    assert biquad.reset(p, s, 5.0) == 0.0
    assert biquad.step(p, s, 5.0) == pytest.approx(5.0 * DT)


def test_unstable_or_too_fast_biquad_is_refused():
    with pytest.raises(ValueError, match="unstable"):
        biquad.build(biquad.BiquadSettings(b0=1.0, a1=-2.1, a2=1.0), DT)
    with pytest.raises(ValueError, match="6000 Hz is not below half the sample rate of 10000 Hz"):
        biquad.bilinear2([1.0], [1.0, 1.0], DT, prewarp=2 * np.pi * 6000)
    with pytest.raises(ValueError, match="order 2 at most"):
        biquad.bilinear2([1.0, 0.0], [1.0], DT)
