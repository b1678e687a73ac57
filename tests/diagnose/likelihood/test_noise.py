import numpy as np
import pytest
from scipy.signal import lfilter

from rtctl.diagnose.likelihood.noise import (
    SPAN,
    Noise,
    filtered,
    gridded,
    levels,
    neighbours,
    noise_of,
    noises_of,
    whitened,
)  # fmt: skip

A = np.array([1.0, -1.5, 0.7])  # coefficients of the known process
ALL = np.arange(20_000)


def test_autoregression_recovers_a_known_process():
    e = lfilter([1.0], A, 0.02 * np.random.default_rng(1).standard_normal(20_000))
    found = noise_of(e, 2, 1e-9)
    np.testing.assert_allclose(found.a, A, atol=0.02)
    np.testing.assert_allclose(found.sigma, 0.02, rtol=0.02)
    (white,) = whitened([found], e[:, None], [ALL])
    assert len(white) == len(e) - found.order
    np.testing.assert_allclose(white.std(), 1.0, rtol=0.01)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.02


def test_innovation_level_has_a_lower_bound():
    assert noise_of(1e-6 * np.random.default_rng(1).standard_normal(1000), 3, 1e-3).sigma == 1e-3


def test_constant_offset_does_not_affect_the_noise_model():
    e = np.random.default_rng(2).standard_normal(4000)
    shifted = noise_of(e + 50.0, 4, 1e-9)
    np.testing.assert_allclose(shifted.a, noise_of(e, 4, 1e-9).a, atol=1e-9)
    assert shifted.filtered(e + 50.0).mean() > 10.0


def test_short_residual_limits_the_autoregression_order():
    assert noise_of(np.random.default_rng(3).standard_normal(100), 20, 1e-9).order == 5


def test_filter_matches_a_direct_convolution():
    rng = np.random.default_rng(5)
    for taps, rows in ((1, 7), (3, 3), (4, 50), (21, 1000), (4, 6)):
        a, e = rng.standard_normal(taps), rng.standard_normal((rows, 2, 3))
        expected = [[np.convolve(e[:, i, j], a, "valid") for j in range(3)] for i in range(2)]
        np.testing.assert_allclose(filtered(a, e), np.moveaxis(np.array(expected), 2, 0), atol=1e-12)
        assert filtered(a, e.astype(np.float32)).dtype == np.float32
    assert filtered(np.ones(4), np.ones((2, 3))).shape == (0, 3)


def test_filter_of_many_residuals_equals_single_filters():
    noise = Noise(A, 0.5)
    e = np.random.default_rng(4).standard_normal((50, 3))
    np.testing.assert_allclose(noise.filtered(e)[:, 1], noise.filtered(e[:, 1]))


def test_filter_of_zero_columns_keeps_the_shape():
    noise = Noise(A, 0.5)
    assert noise.filtered(np.zeros((100, 0))).shape == (98, 0)
    assert noise.filtered(np.zeros((100, 3))).shape == (98, 3)


def test_common_force_of_two_sensors_counts_once():
    rng = np.random.default_rng(5)
    force = lfilter([1.0], A, rng.standard_normal(20_000))
    e = np.stack([force, np.roll(force, 1)], axis=1) + 0.1 * rng.standard_normal((20_000, 2))
    both, white = noises_of(e, [ALL, ALL], 4, np.full(2, 1e-9))
    alone = noise_of(e[:, 1], 4, 1e-9)
    assert both[0] == noise_of(e[:, 0], 4, 1e-9)._replace(a=both[0].a)
    assert both[1].sigma < 0.6 * alone.sigma
    first, second = whitened(both, e, [ALL, ALL])
    for found, expected in zip(white, (first, second), strict=True):
        np.testing.assert_allclose(found, expected)
    np.testing.assert_allclose((first.std(), second.std()), 1.0, rtol=0.01)
    assert abs(np.corrcoef(first[len(first) - len(second) :], second)[0, 1]) < 0.02


def test_cross_prediction_adapts_the_autoregression_of_the_second_sensor():
    """The first sensor predicts a ringing of the second sensor, with or without a slow wave in the second sensor:
    only the wave raises the innovation level."""
    rng = np.random.default_rng(9)
    force = rng.standard_normal(20_000)
    ring = lfilter([1.0], [1.0, -1.95, 0.98], force)
    wave = 300.0 * np.sin(2.0 * np.pi * 2e-4 * ALL)
    own = 0.3 * rng.standard_normal(20_000)
    left = []
    for beside in (0.0, wave):
        e = np.stack([force, ring + beside + own], axis=1)
        left.append(noises_of(e, [ALL, ALL], 20, np.full(2, 1e-9))[0][1].sigma)
    assert left[0] == pytest.approx(0.3, rel=0.2)
    assert left[0] < left[1] < 1.6 * left[0]


def test_independent_sensors_have_no_cross_prediction():
    e = np.random.default_rng(6).standard_normal((20_000, 2))
    (_, two), _ = noises_of(e, [ALL, ALL], 4, np.full(2, 1e-9))
    assert np.abs(two.beside[0]).max() < 0.03
    np.testing.assert_allclose(two.sigma, 1.0, rtol=0.02)


def test_cross_prediction_of_a_sensor_with_sparse_rows():
    rng = np.random.default_rng(7)
    e = rng.standard_normal((20_000, 2))
    e[:, 1] = 0.8 * e[:, 0] + 0.6 * e[:, 1]
    rows = ALL[::7]
    both, _ = noises_of(e, [ALL, rows], 0, np.full(2, 1e-9))
    np.testing.assert_allclose(both[1].beside[0], 0.8 * (np.arange(-SPAN, SPAN + 1) == 0), atol=0.05)
    many = rng.standard_normal((20_000, 2, 3))
    whole = whitened(both, many, [ALL, rows])
    single = whitened(both, many[..., 1], [ALL, rows])
    for one, other in zip(whole, single, strict=True):
        np.testing.assert_allclose(one[:, 1], other)


def test_noise_level_that_grows_with_speed_is_estimated():
    rng = np.random.default_rng(8)
    square = rng.uniform(0.0, 4.0, 20_000) ** 2
    e = np.sqrt(0.04 + 0.09 * square) * rng.standard_normal(len(square))
    found = levels(e, square[:, None], 1e-9)
    np.testing.assert_allclose(found**2, 0.04 + 0.09 * square, rtol=0.1)
    np.testing.assert_allclose(levels(e, square[:, None], 1e-9, 0.09 * square), found, rtol=0.1)
    assert levels(e, square[:, None], 0.5).min() == 0.5
    (noise,), (white,) = noises_of(e[:, None], [ALL], 0, np.full(1, 1e-9), [square[:, None]])
    np.testing.assert_allclose(white.std(), 1.0, rtol=0.01)
    assert abs(np.std(white[square < 1.0]) / np.std(white[square > 9.0]) - 1.0) < 0.05
    np.testing.assert_allclose(noise.averaged().sigma, e.std(), rtol=0.01)


def test_constant_noise_level_is_estimated_as_constant():
    rng = np.random.default_rng(9)
    square = rng.uniform(0.0, 4.0, 20_000) ** 2
    found = levels(rng.standard_normal(len(square)), square[:, None], 1e-9)
    np.testing.assert_allclose(found, 1.0, rtol=0.06)


@pytest.mark.parametrize("rows", [np.arange(40), np.arange(3, 31), np.array([0, 1, 2, 9, 10, 38, 39])])
def test_neighbours_are_the_innovations_around_a_row(rows):
    rest = np.random.default_rng(1).standard_normal(len(rows))
    grid = gridded(rest, rows, 40)
    expected = np.stack([grid[at : at + 2 * SPAN + 1] for at in rows])
    np.testing.assert_array_equal(neighbours(grid, rows), expected)
