"""Binned missing forces."""

import numpy as np

from rtctl.diagnose.evidence.hats import binned


def test_bins_reproduce_a_line():
    x = np.tile(np.linspace(-1.0, 1.0, 500), 8)
    middle, y, half, law = binned(x, 3.0 * x, 2.0 * x, 10, 20, np.mean)
    np.testing.assert_allclose(y, 3.0 * middle, atol=0.02)
    np.testing.assert_allclose(law, 2.0 * middle, atol=0.02)
    assert np.all(half > 0.0)


def test_no_samples_give_no_bins():
    none = np.zeros(0)
    assert binned(none, none, none, 10, 20).shape == (4, 0)
