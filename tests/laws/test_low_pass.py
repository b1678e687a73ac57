import numpy as np
import pytest

from rtctl.laws import low_pass

DT = 1e-4


def build(**changes):
    return low_pass.build(low_pass.LowPassSettings(**{"frequency": 250.0, **changes}), DT)


def test_low_pass_gain_at_dc_and_at_the_corner(response):
    assert abs(response(build(), 0.0, DT)) == pytest.approx(1.0)
    assert response(build(), 250.0, DT) == pytest.approx(-1j * np.sqrt(0.5))
    assert abs(response(build(zeta=1.0), 250.0, DT)) == pytest.approx(0.5)


def test_low_pass_rolls_off_by_forty_decibels_per_decade(response):
    p = build(frequency=20.0)
    assert abs(response(p, 40.0, DT) / response(p, 400.0, DT)) == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize("f", [10.0, 100.0, 250.0, 500.0])
def test_low_pass_matches_the_continuous_filter(response, f):
    s, w = 2j * np.pi * f, 2 * np.pi * 250.0
    wanted = w**2 / (s**2 + np.sqrt(2) * w * s + w**2)
    assert response(build(), f, DT) == pytest.approx(wanted, abs=6e-3)


def test_low_pass_corner_above_nyquist_is_refused():
    with pytest.raises(ValueError, match="not below half the sample rate"):
        build(frequency="5 kHz")
