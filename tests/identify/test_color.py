"""CIE 1976: known colours, and a grey image over known errors."""

import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.identify import color

X = np.arange(0, 0.5, 1e-4)


def test_lab_of_white_black_and_a_tabulated_grey():
    """Y = 0.1842 is L* = 50; equal shares of X, Y and Z have no chroma."""
    found = color.lab(np.array([[1.0] * 3, [0.0] * 3, [0.18418651] * 3]))
    assert found == pytest.approx(np.array([[100.0, 0, 0], [0, 0, 0], [50.0, 0, 0]]), abs=1e-4)


def test_colour_difference_is_the_euclidean_distance():
    assert color.difference(np.array([[50.0, 3.0, 4.0]]), np.array([50.0, 0.0, 0.0]))[0] == pytest.approx(5.0)


def test_zero_error_and_a_trend_give_one_colour():
    for e in (0.0 * X, 1e-4 * X):
        assert color.printed(X, e).rms < 1e-9


def test_periodic_error_gives_a_periodic_colour_difference():
    """Twice the error is twice the difference; a wave of the length of the lead has no effect."""
    one, two = (color.printed(X, A * np.sin(2 * np.pi * X / 0.01885)) for A in (2e-6, 4e-6))
    assert two.rms == pytest.approx(2 * one.rms, rel=0.02) and one.rms > 0.05
    assert one.most < 2.5 * one.rms
    assert color.printed(X, 2e-6 * np.sin(2 * np.pi * X / 2e-3)).rms < 0.02 * one.rms


def test_coherence_of_related_and_unrelated_signals():
    rng = np.random.default_rng(3)
    at = np.arange(1200) * 5e-4
    wave = 5e-6 * np.sin(2 * np.pi * at / 0.0188)
    errors = [wave + 1e-7 * rng.standard_normal(1200) for _ in range(8)]
    images = [1e4 * e + 0.02 * rng.standard_normal(1200) for e in errors]
    length, C = color.coherence(errors, images, at, 1200)
    assert C[np.argmin(np.abs(length - 0.0188))] > 0.9
    assert np.median(C[(length > 0.002) & (length < 0.01)]) < 0.4
    with pytest.raises(NoAnswer, match="four"):
        color.coherence(errors[:2], images[:2], at, 1200)


def test_short_record_and_jump_are_refused():
    with pytest.raises(NoAnswer, match="lines of every ink"):
        color.printed(X[:300], 0 * X[:300])
    with pytest.raises(NoAnswer, match="overtake"):
        color.printed(X, np.where(X > 0.2, -1e-4, 0.0))
