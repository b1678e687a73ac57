"""Hiss and what is none, as errors of a model that is kept on track."""

import numpy as np
import pytest
from scipy.signal import lfilter

from rtctl.diagnose.hiss import is_hiss

DT, N, W = 1e-3, 20000, 30.0


def error(force: np.ndarray, b: float = 0.0, k: float = 0.0) -> np.ndarray:
    """e'' + (1.4 W + b) e' + (W^2 + k) e = W^2 force, backward differences."""
    damper, spring = (1.4 * W + b) * np.array([1.0, -1.0, 0.0]) / DT, np.array([W**2 + k, 0.0, 0.0])
    a = np.array([1.0, -2.0, 1.0]) / DT**2 + damper + spring
    return lfilter([W**2], a, force)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(N)


# of fixed seeds: a bound of chance is passed by chance too, at some seed in ten thousand


@pytest.mark.parametrize("size", [1.0, 5.0, 30.0])
@pytest.mark.parametrize("seed", range(0, 20, 2))
def test_white_forces_are(seed, size):
    e = error(size * noise(seed)) + 0.3 * noise(seed + 1)
    assert is_hiss(e, DT, W, 0.3)


@pytest.mark.parametrize("size", [3.0, 30.0])
@pytest.mark.parametrize("lag", [1e-3, 0.008, 0.03])
@pytest.mark.parametrize("seed", range(0, 10, 2))
def test_so_are_forces_behind_a_short_lag(seed, size, lag):
    pole = np.exp(-DT / lag)
    force = lfilter([1.0], [1.0, -pole], noise(seed)) * np.sqrt(1.0 - pole**2)
    assert is_hiss(error(size * force) + 0.3 * noise(seed + 1), DT, W, 0.3)


def test_a_machine_on_a_spring_lets_less_of_the_slow_ones_through():
    e = error(30.0 * noise(2), b=6.0, k=2 * W**2) + 0.3 * noise(3)
    assert is_hiss(e, DT, W, 0.3, exact=True, own=(6.0, 2 * W**2))
    assert not is_hiss(e, DT, W, 0.3, exact=True)


def test_a_reading_that_wanders_is_not():
    walk = np.cumsum(noise(3))
    assert not is_hiss(walk - error(walk) + 0.3 * noise(4), DT, W, 0.3, exact=True)


@pytest.mark.parametrize("what", ["drift", "reversals", "ripple", "vibration"])
def test_what_has_a_pattern_is_not(what):
    t = DT * np.arange(N)
    force = {
        "drift": t / t[-1], "reversals": np.sign(np.sin(2 * np.pi * 0.4 * t)), "ripple": np.sin(2 * np.pi * 2.3 * t),
        "vibration": 50.0 * np.sin(2 * np.pi * 40.0 * t),
    }[what]  # fmt: skip
    assert not is_hiss(error(3.0 * force + noise(0)) + 0.05 * noise(1), DT, W, 0.05)


@pytest.mark.parametrize("seed", range(5))
def test_forces_that_come_in_bursts_are_not(seed):
    """White while they last: their spectrum is that of hiss."""
    moves = np.sin(2 * np.pi * 0.4 * DT * np.arange(N)) > 0.7
    assert not is_hiss(error(8.0 * moves * noise(seed)) + 0.3 * noise(seed + 1), DT, W, 0.3)


def test_a_record_too_short_for_a_spectrum_says_nothing():
    assert not is_hiss(noise(0)[:500], DT, W, 1.0)
