"""Backlash: no force in the gap, linear spring beyond the gap, lag of the sensor."""

import bench
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants.physics import transmission


@settings(deadline=None)
@given(st.floats(-1, 1), st.floats(0, 0.5), st.floats(0, 1))
def test_dead_zone_is_odd_and_close_to_the_sharp_form(e, half, edge):
    d, slope = transmission.dead_zone(e, half, edge)
    sharp = transmission.dead_zone(e, half, 0.0)[0]
    assert sharp == pytest.approx(np.sign(e) * max(abs(e) - half, 0.0), abs=1e-15)
    assert -1e-12 <= slope <= 1.0 + 1e-12
    assert d * e >= -1e-12
    assert abs(d - sharp) <= 0.5 * edge * half + 1e-12  # largest at the edge
    assert transmission.dead_zone(-e, half, edge) == pytest.approx((-d, slope), abs=1e-12)


@settings(deadline=None)
@given(st.floats(0.01, 1), st.floats(1e-3, 0.5), st.floats(0.01, 1))
def test_dead_zone_slope_is_its_derivative(e, half, edge):
    d = [transmission.dead_zone(x, half, edge)[0] for x in (e - 1e-7, e + 1e-7)]
    assert (d[1] - d[0]) / 2e-7 == pytest.approx(transmission.dead_zone(e, half, edge)[1], abs=1e-2)


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_motor_moves_freely_within_the_gap(damping):
    term = bench.usual("transmission.backlash", "ldu", "motor", gap=1.0, damping=damping, edge=0.0)
    r = bench.run("ldu", [term], np.zeros((4, 1)), speeds={"motor": 50.0}, substeps=20)
    if damping:
        assert r.v[-1, 0] < 49.0
    else:
        assert r.v[-1, 0] == pytest.approx(50.0 * np.exp(-5e-8 / 1e-6 * 4e-3), rel=1e-4)
        assert abs(r.v[-1, 1]) < 0.01 * 50.0


def test_motor_crosses_the_gap_before_the_wheel_follows():
    gap, small = 1e-3, 0.004  # slow: the impact does not move the carriage
    term = bench.usual("transmission.backlash", "ldu", "motor", gap=gap, damping=1.0, edge=0.0)
    r = bench.run("ldu", [term], np.repeat([small, -small], 900).reshape(-1, 1))
    wound = small * 21e-3 / 4.2  # elastic windup of the shaft
    e = r.q[:, 0] - 20 * r.q[:, 1]
    assert e[899] == pytest.approx(gap / 2 + wound, rel=0.02)
    assert e[-1] == pytest.approx(-gap / 2 - wound, rel=0.02)


def test_axis_sensor_lags_by_the_gap_after_a_reversal():
    gap = 1e-4
    inputs = bench.moves("axis")
    r = bench.run("axis", [bench.usual("transmission.backlash", "axis", gap=gap)], inputs)
    behind = r.y[:, 0] - r.q[:, 0]
    assert np.abs(behind).max() == pytest.approx(gap / 2, rel=1e-9)
    forwards, backwards = r.v[:, 0] > 1e-3, r.v[:, 0] < -1e-3
    assert np.median(behind[forwards]) == pytest.approx(-gap / 2)
    assert np.median(behind[backwards]) == pytest.approx(gap / 2)
    steady = r.v[1:, 0] * r.v[:-1, 0] > 0
    assert (np.diff(r.y[:, 0]) * np.sign(r.v[1:, 0]) >= 0.0)[steady].all()


def test_backlash_of_a_rigid_nut_displaces_the_table():
    import machine

    term = machine.settings("transmission.backlash", "nut", gap=2e-4, c=4e6)
    push = np.repeat([0.6, -0.6, 0.6], 300)
    r = machine.run(machine.SCREW, [term], push)
    behind = r.y[:, 1] - 1.6e-3 * r.x[:, 1]
    assert np.abs(behind).max() == pytest.approx(1e-4, rel=0.25)
    assert behind[290] == pytest.approx(-1e-4, rel=0.1) and behind[590] == pytest.approx(1e-4, rel=0.1)
