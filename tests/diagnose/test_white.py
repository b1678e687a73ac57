"""Errors that are made white: each sensor by its own filter, and the same for a model's as for a recording's."""

import numpy as np
import pytest
from scipy.signal import lfilter

from rtctl.diagnose.problem import Problem
from rtctl.diagnose.stretches import memory, rms
from rtctl.diagnose.white import White, taps_of


def wandering(n=20000, pole=0.97, size=3.0, seed=0):
    return lfilter([size], [1.0, -pole], np.random.default_rng(seed).standard_normal(n))


@pytest.mark.parametrize("size", [0.1, 3.0])
def test_what_is_left_of_wandering_errors_is_white_and_of_unit_size(size):
    e = wandering(size=size)
    taps = taps_of(e)
    white = lfilter(taps, [1.0], e)[len(taps) :]
    assert memory(e) > 30.0
    assert memory(white) == pytest.approx(1.0, abs=0.1)
    assert rms(white) == pytest.approx(1.0, rel=0.02)
    np.testing.assert_allclose(taps[:3] / taps[0], [1.0, -0.97, 0.0], atol=0.03)


def test_of_few_errors_no_filter_is_made():
    e = np.array([3.0, -3.0, 3.0, -3.0])
    np.testing.assert_allclose(taps_of(e), [1.0 / 3.0])
    assert np.isfinite(taps_of(np.zeros(4))).all()


def test_a_model_is_seen_through_the_same_filter(plain):
    problem = Problem(plain.sim)
    r = problem.residual(plain.model)
    white = White(problem, r)
    passed = white.residual(plain.model)
    np.testing.assert_allclose(passed, white.through(r))
    assert white.floor == 1.0
    assert rms(passed) == pytest.approx(1.0, rel=0.01)
    assert problem.residual(plain.model) is not passed  # the problem itself is as it was
    np.testing.assert_array_equal(problem.residual(plain.model), r)


def test_each_sensor_passes_its_own(plain):
    problem = Problem(plain.sim)
    problem.source = np.arange(len(problem.source)) % 2  # as if every other error were of a second one
    r = np.empty(len(problem.source))
    for sensor, pole in enumerate((0.97, 0.0)):
        own = problem.source == sensor
        r[own] = wandering(int(own.sum()), pole, seed=sensor)
    white = White(problem, r)
    out = white.through(np.column_stack([r, 2.0 * r]))
    np.testing.assert_allclose(out[:, 1], 2.0 * out[:, 0])
    for sensor, taps in white.taps.items():
        own = out[problem.source == sensor, 0]
        assert (own[: len(taps) - 1] == 0.0).all()  # nothing foretells them
        assert rms(own[len(taps) :]) == pytest.approx(1.0, rel=0.05)
