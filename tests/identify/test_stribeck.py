"""Fit of the Stribeck curve: informative points, and noise alone."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer
from rtctl.identify.stribeck import stribeck


@settings(deadline=None, max_examples=40)
@given(
    F_C=st.floats(1e-3, 10.0),
    rise=st.floats(0.1, 2.0),
    v_s=st.floats(0.3, 2.0),
    F_v=st.floats(0.0, 0.1),
)
@example(F_C=1.0, rise=2.0, v_s=1.9375, F_v=0.0)  # between two points of the grid
def test_fit_finds_the_stribeck_curve(F_C, rise, v_s, F_v):
    v = np.array([0.0, 0.1, 0.2, 0.4, 0.8, 1.2, 1.6, 2.5, 4.0, 6.0])
    fit = stribeck(v, F_C * (1 + rise * np.exp(-((v / v_s) ** 2)) + F_v * v))
    assert fit.F_C == pytest.approx(F_C, rel=0.02)
    assert fit.F_S == pytest.approx(F_C * (1 + rise), rel=0.02)
    assert fit.v_s == pytest.approx(v_s, rel=0.03)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000))
def test_noise_alone_gives_no_stribeck_effect(seed):
    v = np.array([0.0, 0.2, 0.5, 1.0, 2.0, 4.0])
    fit = stribeck(v, 1.0 + 2e-3 * np.random.default_rng(seed).standard_normal(6))
    assert fit.F_S is None and fit.v_s is None
    assert abs(fit.F_C - 1.0) < 0.02


def test_friction_fall_below_the_slowest_speed_has_no_stribeck_speed():
    v = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 6.0])
    fit = stribeck(v, 1.0 + 0.5 * np.exp(-((v / 0.01) ** 2)))
    assert fit.F_S == pytest.approx(1.5)
    assert fit.v_s is None
    assert stribeck(v, 1.0 + 0.5 * np.exp(-((v / 0.01) ** 2)), fall=False).F_S is None


def test_too_few_speeds_are_refused():
    with pytest.raises(NoAnswer, match="2 different speeds"):
        stribeck([0.0, 1.0, 2.0], [1.0, 1.0, 1.0])
