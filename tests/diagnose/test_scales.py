"""How fast, far and hard nodes move, on motions that can be worked out by hand."""

import numpy as np
import pytest

from rtctl.diagnose.model import owner_model
from rtctl.diagnose.scales import node_scales

A, W = 0.02, 2 * np.pi  # m or rad, rad/s


def sine(blank, plant, per_unit, volts):
    rate = {"axis": 1000, "ivu": 500, "ldu": 10000}[plant]
    t = np.arange(4 * rate) / rate
    record = blank(plant, volts(t), A * (1 + np.sin(W * t)) * per_unit)
    return node_scales(record, owner_model(record.case).base)


def test_an_axis_moves_by_its_own_position_and_the_force_of_its_volts(blank):
    scales = sine(blank, "axis", 1.0, lambda t: 2.0 * np.sin(W * t))
    for node in ("carriage", "sensor"):
        s = scales[node]
        assert s.span == pytest.approx(2 * A, rel=1e-3)
        assert s.low == pytest.approx(0.0, abs=1e-6)
        assert s.speed == pytest.approx(A * W / np.sqrt(2), rel=0.03)  # where it stands it does not count
        assert s.force == pytest.approx(35.0 * 2.0 / np.sqrt(2), rel=1e-3)


def test_a_constant_pull_is_no_force_that_moves(blank):
    one = sine(blank, "axis", 1.0, lambda t: np.sin(W * t))["carriage"].force
    two = sine(blank, "axis", 1.0, lambda t: np.sin(W * t) + 3.0)["carriage"].force
    assert two == pytest.approx(one, rel=1e-6)


def test_reels_turn_by_the_ratio_of_their_radii_and_the_second_one_backwards(blank):
    scales = sine(blank, "ivu", 10000 / (2 * np.pi), lambda t: np.stack([np.sin(W * t), -np.sin(W * t)], axis=1))
    capstan, one, two = scales["capstan"], scales["reel1"], scales["motor2"]
    assert one.span == pytest.approx(capstan.span * 0.0125 / 0.035, rel=1e-9)
    assert two.speed == pytest.approx(capstan.speed * 0.0125 / 0.028, rel=1e-9)
    assert two.low == pytest.approx(-two.span, rel=1e-3)
    assert one.low == pytest.approx(0.0, abs=1e-3)
    assert scales["tape1"].span == pytest.approx(0.0125 * capstan.span, rel=1e-9)
    assert one.force == pytest.approx(0.061 * 0.2 / np.sqrt(2), rel=1e-3)


def test_a_carriage_moves_in_metres_and_its_motor_by_the_gear(blank):
    scales = sine(blank, "ldu", 20000 / (2 * np.pi), lambda t: np.sin(W * t))
    encoder = scales["encoder"]
    assert scales["carriage"].span == pytest.approx(0.003 * encoder.span, rel=1e-9)
    assert scales["motor"].speed == pytest.approx(20 * encoder.speed, rel=1e-9)
    power = [scales[n].force * scales[n].speed for n in ("motor", "wheel", "capstan", "carriage", "scale")]
    np.testing.assert_allclose(power, power[0], rtol=1e-9)  # a stiff gear keeps it


def test_a_machine_at_rest_has_scales_above_zero(blank):
    record = blank("axis", np.zeros(100))
    s = node_scales(record, owner_model(record.case).base)["carriage"]
    assert min(s.speed, s.span, s.force) > 0.0
