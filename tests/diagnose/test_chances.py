"""Chances, on errors of known distribution."""

import numpy as np
import pytest
from by_hand import made
from scipy.stats import kstest

from rtctl.diagnose.chances import by_accident, by_noise, p_value


def test_what_acts_everywhere_and_fits_in_one_place_is_an_accident():
    rng = np.random.default_rng(5)
    noise, rows = rng.standard_normal(8000), np.arange(8000)
    wave, once = np.sin(0.01 * rows), 3.0 * ((rows >= 3000) & (rows < 3300))
    there = made(noise + wave, 1), made(noise, 2)
    fits = made(noise + once, 1), made(noise + once - wave * float(wave @ once) / float(wave @ wave), 2)
    assert by_accident(*there, 200) < 1e-20
    assert by_accident(*fits, 200) > 1e-2
    gone = made(noise + once, 1), made(noise, 2)
    assert by_accident(*gone, 300) > 1e-3 > by_noise(*gone)  # what is seen once is no law


@pytest.mark.parametrize("seed", range(5))
def test_a_number_that_follows_noise_does_so_by_accident_as_often_as_chance_has_it(seed):
    rng = np.random.default_rng(seed)
    own, luck = rng.standard_normal(8000), []
    for k in range(40):
        e, wave = np.roll(own, 37 * k), np.sin((0.003 + 0.0007 * k) * np.arange(8000))
        luck.append(by_accident(made(e, 1), made(e - wave * float(wave @ e) / float(wave @ wave), 2), 200))
    assert min(luck) > 1e-4


def smooth(rng, n, memory):
    """Errors (n,) of variance one that go together for `memory` rows."""
    white = rng.standard_normal(n + 8 * memory)
    kernel = np.exp(-np.arange(8 * memory) / memory)
    return np.convolve(white, kernel / np.linalg.norm(kernel), "valid")[:n]


@pytest.mark.parametrize("memory", [1, 10])
def test_between_equals_every_p_value_is_as_likely_as_any_other(memory):
    """Two models whose errors are alike and independent; blocks are longer than the errors go together."""
    rng = np.random.default_rng(5)
    p = [p_value(made(smooth(rng, 4000, memory)), made(smooth(rng, 4000, memory)), 100) for _ in range(300)]
    assert kstest(p, "uniform").pvalue > 0.01


def test_errors_that_go_together_would_deceive_a_test_of_single_rows():
    rng = np.random.default_rng(5)
    p = np.array([p_value(made(smooth(rng, 4000, 20)), made(smooth(rng, 4000, 20)), 1) for _ in range(200)])
    assert np.mean(p < 0.05) > 0.1  # which is why there are blocks


def test_a_rival_that_is_worse_has_a_small_p_value_and_one_that_is_better_a_large_one():
    rng = np.random.default_rng(1)
    best = rng.standard_normal(4000)
    assert p_value(made(best), made(1.1 * best), 100) < 1e-6
    assert p_value(made(1.1 * best), made(best), 100) > 1 - 1e-6
    assert p_value(made(best), made(best), 100) == pytest.approx(0.5)


def test_p_values_of_the_two_directions_add_up_to_one():
    rng = np.random.default_rng(2)
    one, two = made(rng.standard_normal(2000)), made(1.02 * rng.standard_normal(2000))
    assert p_value(one, two, 50) + p_value(two, one, 50) == pytest.approx(1.0)


def test_a_record_of_a_few_blocks_proves_nothing():
    assert p_value(made(np.ones(300)), made(np.full(300, 9.0)), 100) == 1.0
