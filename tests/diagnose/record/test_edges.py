"""What reels without direction tell: edges of a disc whose way is known, and what a fit makes of them."""

import numpy as np
import pytest

from rtctl.diagnose.record.edges import directions, edges

T = 2e-3 * np.arange(15000)
WAY = 40 * np.sin(2 * np.pi * 0.11 * T) + 7 * np.sin(2 * np.pi * 0.53 * T)  # counts of a reel, there and back


def counter(way, phase=0.37):
    """What a disc that stood at `phase` shows of it: one more for every edge that goes past, either way."""
    return np.concatenate([[0], np.cumsum(np.abs(np.diff(np.floor(way + phase))))])


@pytest.mark.parametrize("phase", [0.0, 0.37, 0.81])
@pytest.mark.parametrize("stretch", [1.0, 0.97, 1.03])
def test_every_edge_is_found_whatever_the_way_back(phase, stretch):
    found = edges(counter(WAY, phase), stretch * WAY, 1)
    assert found is not None and len(found.rows) == counter(WAY, phase)[-1]
    true = WAY[found.rows] - found.at  # but for the tick in which it came, and where the disc stood
    assert np.ptp(true) < 2 * np.abs(np.diff(WAY)).max()


def test_a_reading_between_two_edges_is_as_good_as_they_are():
    found = edges(counter(WAY), WAY, 0)
    exact = found.error(np.stack([WAY], axis=1))
    assert np.sqrt(np.mean(exact**2)) < 1.0
    off = found.error(np.stack([WAY + 0.2 * np.sin(0.3 * WAY)], axis=1)) * found.sigma
    assert np.std(off) == pytest.approx(0.2 / np.sqrt(2), rel=0.1)
    some = found.between(1000, 3000)
    assert some.rows.min() >= 1000 and some.rows.max() < 3000


def test_of_a_reel_that_spins_freely_one_edge_a_tick_is_kept():
    way = 800 * np.sin(2 * np.pi * 0.5 * T)
    found = edges(counter(way), way, 0)
    assert counter(way)[-1] > len(T) > len(found.rows) > 0.9 * len(T)
    assert (np.diff(found.rows) > 0).all()
    e = found.error(way[:, None])
    assert np.std(e * found.sigma) < 0.3 and np.std(e) < 1.2  # counts, and by their noise


def rising(way, phase=0.37):
    """What a sensor shows of it that counts where dark turns to light, a quarter of a period on or three back."""
    light = np.mod(way + phase, 1.0) - 0.5
    light = np.abs(light) < 0.25
    return np.concatenate([[0], np.cumsum(light[1:] & ~light[:-1])])


def test_a_sensor_of_rising_edges_has_others_on_the_way_back():
    found = edges(rising(WAY), 1.02 * WAY, 0)
    assert set(found.group) == {0, 1}
    exact = found.error(np.stack([WAY], axis=1))
    assert np.sqrt(np.mean(exact**2)) < 1.0
    off = found.at - found.way(np.stack([WAY], axis=1))
    ends = [np.mean(off[found.group == g]) for g in (0, 1)]
    assert abs(ends[0] - ends[1]) < 0.05  # half a count off is what they were taken to be


def test_a_model_that_does_not_know_the_way_is_not_believed():
    assert edges(counter(WAY), np.roll(WAY, 1500), 1) is None
    assert edges(counter(WAY), np.full_like(WAY, np.nan), 1) is None
    assert edges(counter(0.1 * WAY[:3000]), 0.1 * WAY[:3000], 1) is None  # too few


def test_of_all_directions_those_that_fit_as_a_whole():
    forward, steps = directions(np.array([1.0, 0.9, 0.1, -1.1, -0.6, 0.2, 1.0]))
    assert steps.tolist() == [1, 1, 0, -1, -1, 0, 1]
    assert forward.tolist() == [True, True, True, False, False, False, True, True]
