import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.laws import notch

DT = 1e-4


def build(**changes):
    return notch.build(notch.NotchSettings(**{"frequency": 119.0, "zeta_z": 0.05, "zeta_p": 0.5, **changes}), DT)


@settings(deadline=None)
@given(st.floats(5.0, 4500.0), st.floats(0.0, 0.4))
def test_notch_gain_is_the_ratio_of_the_dampings(f, zeta_z):
    p = build(frequency=f, zeta_z=zeta_z)
    z = np.exp(-2j * np.pi * f * DT)
    gain = abs((p.b0 + p.b1 * z + p.b2 * z * z) / (1 + p.a1 * z + p.a2 * z * z))
    assert gain == pytest.approx(zeta_z / 0.5, abs=1e-6)


def test_gain_is_one_far_from_the_notch(response):
    assert abs(response(build(), 0.0, DT)) == pytest.approx(1.0)
    assert abs(response(build(), 5000.0, DT)) == pytest.approx(1.0)


@pytest.mark.parametrize("f", [20.0, 100.0, 119.0, 150.0, 300.0])
def test_notch_matches_the_continuous_filter(response, f):
    s, w = 2j * np.pi * f, 2 * np.pi * 119.0
    wanted = (s**2 + 0.1 * w * s + w**2) / (s**2 + 1.0 * w * s + w**2)
    assert response(build(), f, DT) == pytest.approx(wanted, abs=5e-3)


def test_peak_and_notch_above_nyquist_are_refused():
    with pytest.raises(ValueError, match="gain would rise"):
        build(zeta_z=0.6)
    with pytest.raises(ValueError, match="not below half the sample rate"):
        build(frequency="5 kHz")
