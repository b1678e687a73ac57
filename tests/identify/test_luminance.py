"""Luminance of a grey image: correlation with the position error."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer
from rtctl.identify import luminance as lu

X = np.linspace(0, 0.61, 12_000)
TURN = 2 * np.pi * 3e-3


def error(amplitude=5.8e-6, wavelength=TURN):
    return 6e-4 * X + amplitude * np.sin(2 * np.pi * X / wavelength)


def test_luminance_has_the_wavelength_of_the_capstan():
    image = lu.printed(X, error())
    cross = lu.cross_spectrum(X, error(), image, 1200, 0.6)
    (first, *_) = lu.shared(cross)
    assert first[0] == pytest.approx(18.75e-3)
    assert first[2] > 0.999
    k = int(np.argmax(np.abs(cross.S)))
    assert cross.S[k] == cross.E[k] * cross.Gamma[k]


def test_luminance_band_of_figure_11_10():
    band = lu.band_pass(lu.printed(X, error()))
    assert band.wavelength == pytest.approx(TURN, rel=2e-3)
    assert band.ripple < 0.15  # a relatively constant amplitude


@settings(deadline=None, max_examples=20)
@given(amplitude=st.floats(1e-6, 1e-5))
def test_luminance_amplitude_is_proportional_to_the_error(amplitude):
    """Closer lines are darker: dL follows the coverage, from the travel over `lead`."""
    s = lu.PrintSettings(noise=0.0, drift=0.0)
    image = lu.printed(X, error(amplitude), s)
    gap = 2 * amplitude * np.sin(np.pi * s.lead / TURN)  # amplitude of e(x + lead) - e(x)
    slope = 116 / 3 * 0.45 ** (-2 / 3) * 0.8 * 0.5 / s.pitch
    aperture = np.sinc(s.aperture / TURN)
    assert np.ptp(image.L[20:-20]) / 2 == pytest.approx(slope * gap * aperture, rel=0.12)


def test_even_image_does_not_correlate_with_the_error():
    image = lu.printed(X, 6e-4 * X)
    with pytest.raises(NoAnswer, match="share no wavelength"):
        lu.shared(lu.cross_spectrum(X, error(), image, 1200, 0.6))
    with pytest.raises(NoAnswer, match="no wave of constant size"):
        lu.band_pass(image)


def test_invalid_records_are_refused():
    with pytest.raises(NoAnswer, match="an image takes 100"):
        lu.printed(X[:100], 0 * X[:100])
    with pytest.raises(NoAnswer, match="overtake"):
        lu.printed(X, np.where(X > 0.3, -1e-3, 0.0))
    with pytest.raises(NoAnswer, match="too short for waves of 20 mm; take 8"):
        lu.band_pass(lu.printed(X[:2000], error()[:2000]))
