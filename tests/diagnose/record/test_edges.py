"""Edges of reel sensors without direction, with a known path."""

import numpy as np
import pytest

from rtctl.diagnose.record.edges import directions, edges

T = 2e-3 * np.arange(15000)
WAY = 40 * np.sin(2 * np.pi * 0.11 * T) + 7 * np.sin(2 * np.pi * 0.53 * T)  # counts of a reel, there and back


def counter(way, phase=0.37):
    """Count (n,) of a disc at initial `phase`: plus one for every edge in either direction."""
    return np.concatenate([[0], np.cumsum(np.abs(np.diff(np.floor(way + phase))))])


@pytest.mark.parametrize("phase", [0.0, 0.37, 0.81])
@pytest.mark.parametrize("stretch", [1.0, 0.97, 1.03])
def test_every_edge_is_decoded_for_any_phase_and_stretch(phase, stretch):
    found = edges(counter(WAY, phase), stretch * WAY, 1)
    assert found is not None and len(found.rows) == counter(WAY, phase)[-1]
    true = WAY[found.rows] - found.at  # up to the tick of the edge and the initial phase
    assert np.ptp(true) < 2 * np.abs(np.diff(WAY)).max()


def test_edge_error_measures_the_path_error():
    found = edges(counter(WAY), WAY, 0)
    exact = found.error(np.stack([WAY], axis=1))
    assert np.sqrt(np.mean(exact**2)) < 1.0
    off = found.error(np.stack([WAY + 0.2 * np.sin(0.3 * WAY)], axis=1)) * found.sigma
    assert np.std(off) == pytest.approx(0.2 / np.sqrt(2), rel=0.1)
    some = found.between(1000, 3000)
    assert some.rows.min() >= 1000 and some.rows.max() < 3000


def test_fast_reel_keeps_one_edge_per_tick():
    way = 800 * np.sin(2 * np.pi * 0.5 * T)
    found = edges(counter(way), way, 0)
    assert counter(way)[-1] > len(T) > len(found.rows) > 0.9 * len(T)
    assert (np.diff(found.rows) > 0).all()
    e = found.error(way[:, None])
    assert np.std(e * found.sigma) < 0.3 and np.std(e) < 1.2  # in counts, and in units of the noise


def rising(way, phase=0.37):
    """Count (n,) of a sensor of rising edges: one edge position per direction."""
    light = np.mod(way + phase, 1.0) - 0.5
    light = np.abs(light) < 0.25
    return np.concatenate([[0], np.cumsum(light[1:] & ~light[:-1])])


def test_rising_edges_have_one_position_per_direction():
    found = edges(rising(WAY), 1.02 * WAY, 0)
    assert set(found.group) == {0, 1}
    exact = found.error(np.stack([WAY], axis=1))
    assert np.sqrt(np.mean(exact**2)) < 1.0
    off = found.at - found.way(np.stack([WAY], axis=1))
    ends = [np.mean(off[found.group == g]) for g in (0, 1)]
    assert abs(ends[0] - ends[1]) < 0.05  # without direction groups the difference is half a count


def test_edges_with_a_wrong_path_are_not_decoded():
    assert edges(counter(WAY), np.roll(WAY, 1500), 1) is None
    assert edges(counter(WAY), np.full_like(WAY, np.nan), 1) is None
    assert edges(counter(0.1 * WAY[:3000]), 0.1 * WAY[:3000], 1) is None  # too few


def test_directions_are_decoded_jointly():
    forward, steps = directions(np.array([1.0, 0.9, 0.1, -1.1, -0.6, 0.2, 1.0]))
    assert steps.tolist() == [1, 1, 0, -1, -1, 0, 1]
    assert forward.tolist() == [True, True, True, False, False, False, True, True]
