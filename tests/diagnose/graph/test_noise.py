import numpy as np
from scipy.signal import lfilter

from rtctl.diagnose.graph.noise import Noise, noise_of

A = np.array([1.0, -1.5, 0.7])  # of a known process


def test_autoregression_of_a_known_process():
    e = lfilter([1.0], A, 0.02 * np.random.default_rng(1).standard_normal(20_000))
    found = noise_of(e, 2, 1e-9)
    np.testing.assert_allclose(found.a, A, atol=0.02)
    np.testing.assert_allclose(found.sigma, 0.02, rtol=0.02)
    white = found.whiten(e)
    assert len(white) == len(e) - found.order
    np.testing.assert_allclose(white.std(), 1.0, rtol=0.01)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.02


def test_least_innovation():
    assert noise_of(1e-6 * np.random.default_rng(1).standard_normal(1000), 3, 1e-3).sigma == 1e-3


def test_a_constant_is_no_noise():
    e = np.random.default_rng(2).standard_normal(4000)
    shifted = noise_of(e + 50.0, 4, 1e-9)
    np.testing.assert_allclose(shifted.a, noise_of(e, 4, 1e-9).a, atol=1e-9)
    assert shifted.whiten(e + 50.0).mean() > 10.0


def test_order_of_a_short_residual():
    assert noise_of(np.random.default_rng(3).standard_normal(100), 20, 1e-9).order == 5


def test_many_residuals_at_once():
    noise = Noise(A, 0.5)
    e = np.random.default_rng(4).standard_normal((50, 3))
    np.testing.assert_allclose(noise.whiten(e)[:, 1], noise.whiten(e[:, 1]))


def test_no_columns_have_no_innovations():
    noise = Noise(A, 0.5)
    assert noise.whiten(np.zeros((100, 0))).shape == (98, 0)
    assert noise.whiten(np.zeros((100, 3))).shape == (98, 3)
