"""Loudness of stretches, and what is usual."""

import numpy as np
import pytest

from rtctl.diagnose.stretches import in_blocks, loudness, usual


def test_each_error_is_told_the_rms_of_its_own_stretch():
    r = np.concatenate([np.full(100, 3.0), np.tile([4.0, -4.0], 50), np.zeros(100)])
    np.testing.assert_allclose(loudness(r), np.repeat([3.0, 4.0, 0.0], 100))


def test_a_few_loud_stretches_are_not_usual():
    r = np.random.default_rng(0).standard_normal(5000)
    r[1000:1500] *= 100.0
    assert usual(r) == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("n", [1, 99, 101, 250])
def test_any_length_will_do(n):
    assert loudness(np.ones(n)) == pytest.approx(np.ones(n))


def test_what_fills_no_block_is_left_out():
    np.testing.assert_array_equal(in_blocks(np.arange(7.0), 3), [3.0, 12.0])
    np.testing.assert_array_equal(in_blocks(np.arange(10.0).reshape(5, 2), 2), [[2.0, 4.0], [10.0, 12.0]])
    assert in_blocks(np.ones(2), 3).shape == (0,)
