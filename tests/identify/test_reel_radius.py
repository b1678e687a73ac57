"""Reel radii: those of the emulator to within a percent; the plain ratio to within (5.3)."""

import bench_runs as runs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer
from rtctl.identify import bench
from rtctl.identify import reel_radius as rr

R_C, PULSES = 0.0125, 209


@pytest.mark.parametrize(("R1", "R2"), [(0.038, 0.022), (0.020, 0.040), (0.030, 0.030)])
def test_radii_of_the_emulator_are_identified(R1, R2):
    config = runs.config("ivu", radius__R1=R1, radius__R2=R2, plant__parameters__R1=R1, plant__parameters__R2=R2)
    record = bench.play(rr.radius_config(config))
    ways = rr.reel_radii(record)
    assert [np.sign(way.travel) for way in ways] == [1, -1]
    for way in ways:
        inside = (record.t >= way.begin) & (record.t <= way.end)
        for one, name in ((way.R1, "truth_R1"), (way.R2, "truth_R2")):
            R = record[name][inside].mean()
            assert one.R == pytest.approx(R, rel=3e-3)
            assert abs(one.plain / R - 1) < 1.2 * one.accuracy
            assert one.half < 0.005 * R


@settings(deadline=None, max_examples=60)
@given(R=st.floats(0.02, 0.04), start=st.floats(0.0, 1.0), speed=st.floats(0.3, 1.5), way=st.sampled_from([-1, 1]))
def test_edge_estimate_is_more_accurate_than_the_plain_ratio(R, start, speed, way):
    phi = way * np.arange(0.0, 2.5, speed * 0.002)
    n = np.floor(np.abs(phi) * R_C / R * PULSES / (2 * np.pi) + start)
    one = rr.radius(phi, n, R_C, PULSES)
    assert abs(one.R - R) <= one.half * 1.01 + 1e-9
    assert abs(one.plain / R - 1) <= 1.05 * one.accuracy


def test_accuracy_is_that_of_the_thesis():
    """5.1: 0.6 rad of reel 1 for 5 %, 24 mm or 1.9 rad of the capstan; 0.7 % for 500 increments."""
    assert rr.accuracy(209, 0.6) == pytest.approx(0.05, rel=0.01)
    assert rr.travel_for(0.05) == pytest.approx(1.9, abs=0.03)
    assert rr.accuracy(500, 1.9) == pytest.approx(0.007, abs=5e-4)


def test_one_way_intervals_end_at_reversals():
    phi = np.concatenate((np.linspace(0, 3, 500), np.linspace(3, 1, 400), np.linspace(1, 5, 600)))
    ways = rr.one_way(phi, 1e-3)
    assert [phi[b - 1] - phi[a] for a, b in ways] == pytest.approx([3, -2, 4], abs=0.02)
    flicker = np.linspace(0, 3, 500) + 5e-4 * (-1.0) ** np.arange(500)
    assert len(rr.one_way(flicker, 1.5e-3)) == 1
    assert rr.one_way(np.zeros(100), 1e-3) == []


def test_short_travel_is_refused():
    n = 1000
    columns = {"capstan": np.linspace(0, 1, n), "reel1_counts": np.arange(n) // 90, "reel2_counts": np.arange(n) // 50}
    with pytest.raises(NoAnswer, match=r"longest way without reversal is 0\.20 rad; it takes 1\.9"):
        rr.reel_radii(runs.made("ivu", columns))
    with pytest.raises(NoAnswer, match="gives 0 pulses"):
        rr.radius(np.linspace(0, 2, 100), np.zeros(100), R_C, PULSES)
