"""Sensor errors: permanent jumps, rectified counting and scale factors, for any reading sequence."""

import math

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from rtctl.plants.physics import sensor

H = 1e-3
TURN = 2 * math.pi


def missed(**values) -> tuple:
    p = sensor.build_missed_counts(sensor.MissedCountsSettings(node="encoder", **values), H)
    return p, np.zeros(1, sensor.MISSED_COUNTS_STATE).view(np.recarray)[0]


def test_missed_counts_remain():
    p, s = missed(at=1.0, size=-0.5, more=((2.0, -0.4), (3.0, -0.2)), over=0.1)
    off = {t: sensor.missed_counts(p, s, 0.0, t) for t in (0.0, 1.0, 1.05, 1.1, 1.9, 2.1, 9.0)}
    assert off == pytest.approx({0.0: 0.0, 1.0: 0.0, 1.05: -0.25, 1.1: -0.5, 1.9: -0.5, 2.1: -0.3, 9.0: -0.2})


def test_too_many_jumps_are_refused():
    with pytest.raises(ValidationError, match="48 further jumps are too many; use at most 47"):
        missed(more=((1.0, 1.0),) * 48)
    assert missed(more=((1.0, 1.0),) * 47)[0].n == 48


@pytest.mark.parametrize(("way", "expected"), [("forward", 3 - 0), ("backward", 2)])
def test_index_mark_adds_an_error_in_one_direction(way, expected):
    p, s = missed(each=1.0, way=way, mark=1.0, turn=2.0)
    for x in [*np.arange(0, 6.5, 0.1), *np.arange(6.5, 1.5, -0.1)]:  # marks at 1, 3, 5; back over 5, 3
        sensor.pass_marks(p, s, x)
    assert sensor.missed_counts(p, s, 1.5, 0.0) == expected
    assert sensor.missed_counts(p, s, 0.5, 0.0) == expected + (way == "backward")  # the mark just passed counts


@settings(deadline=None)
@given(st.floats(-3, 3), st.floats(0.1, 7), st.lists(st.floats(-20, 20), min_size=1, max_size=20))
def test_index_marks_do_not_depend_on_the_number_of_readings(mark, turn, path):
    p, s = missed(each=-0.1, mark=mark, turn=turn)
    assert sensor.missed_counts(p, s, 0.0, 0.0) == 0.0
    for x in path:
        before = sensor.missed_counts(p, s, x, 0.0)
        assert sensor.missed_counts(p, s, x, 0.0) == before  # a reading does not change the state
        sensor.pass_marks(p, s, x)
        assert sensor.missed_counts(p, s, x, 0.0) == before
        assert before <= 0.0


@settings(deadline=None)
@given(st.lists(st.floats(-20, 20), min_size=1, max_size=20), st.floats(0, 1))
def test_rectified_sensor_counts_up_in_both_directions(path, share):
    p = sensor.build_rectified(sensor.RectifiedSettings(node="encoder", share=share), H)
    s, total, was = np.zeros(1, sensor.RECTIFIED_STATE).view(np.recarray)[0], 0.0, 0.0
    for x in path:
        total, was = total + abs(x - was), x
        shown = x + sensor.rectified(p, s, x, x, 0)
        assert shown == pytest.approx((1 - share) * x + share * total, abs=1e-9)
        sensor.go(s, x)
        assert x + sensor.rectified(p, s, x, x, 0) == pytest.approx(shown, abs=1e-9)


@pytest.mark.parametrize(("share", "shown"), [(1.0, 2.0), (0.5, 0.0)])
def test_rectified_speed_sensor_loses_the_sign(share, shown):
    p = sensor.build_rectified(sensor.RectifiedSettings(node="counter", share=share), H)
    s = np.zeros(1, sensor.RECTIFIED_STATE).view(np.recarray)[0]
    sensor.go(s, 7.0)
    assert -2.0 + sensor.rectified(p, s, 7.0, -2.0, 1) == shown
    assert 2.0 + sensor.rectified(p, s, 7.0, 2.0, 1) == 2.0


def test_scale_factor_of_a_sensor():
    p = sensor.build_scale(sensor.ScaleSettings(node="encoder", relative=6e-4), H)
    assert sensor.scale(p, -2.0) == pytest.approx(-2.0012)


SIZES = {
    "sensor.missed_counts": {"at": 0.2, "size": 0.01, "each": 0.01, "turn": 0.01, "mark": 0.003},
    "sensor.rectified": {"share": 1.0},
    "sensor.scale": {"relative": 0.01},
}


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize(("kind", "node", "channel"), [
    ("ivu", "encoder", 0), ("ldu", "encoder", 0), ("ldu", "scale", 1), ("axis", "sensor", 0),
])  # fmt: skip
def test_sensor_error_changes_only_its_channel(name, kind, node, channel):
    u = stand.excitation(kind, 400)
    one, two = stand.run(kind, [], u), stand.run(kind, [stand.make(name, kind, node, **SIZES[name])], u)
    assert np.array_equal(one.x, two.x)
    changed = np.abs(two.y - one.y).max(axis=0) > 0
    assert changed[channel] and changed.sum() == 1


@pytest.mark.parametrize(
    ("kind", "node", "channel"), [("ivu", "encoder", 0), ("ldu", "scale", 1), ("axis", "sensor", 0)]
)
def test_rectified_sensor_of_a_plant_accumulates_the_path(kind, node, channel):
    u = stand.excitation(kind, 800)
    r = stand.run(kind, [stand.make("sensor.rectified", kind, node, share=1.0)], u, substeps=8)
    y = stand.run(kind, [], u, substeps=8).y[:, channel]
    assert (np.diff(r.y[:, channel]) >= 0.0).all()
    way = np.cumsum(np.abs(np.diff(y, prepend=0.0)))
    assert np.abs(r.y[:, channel] - way).max() < 0.01 * way[-1]
