"""Torque ripple map over one turn, of axes with a known torque."""

import numpy as np
import pytest

from rtctl.case.format1 import read_case
from rtctl.diagnose.answer.torque_ripple_map import PLACES, over_turn
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.record.format1 import check

K, J, FRICTION = 0.01, 1e-4, 2e-3
CASE = {
    "format": 1, "plant": "axis", "sample_rate": 500.0, "parameters": {"J": J, "F_c": FRICTION},
    "drive": {"newton_metre_per_ampere": K, "unit": "A"}, "sensors": {"unit": "rad", "x_counts_per_rev": 8192},
    "controller": {"kind": "unknown"}, "controller_known": False, "reaches": {"parameter_tolerance": 0.5},
}  # fmt: skip


def ripple(x):
    """Torque ripple (Nm) at angle x (rad)."""
    return 5e-3 * np.cos(7 * x + 0.4) + 1e-3 * np.sin(12 * x)


def spinning(speed, seconds, noise=0.0, **case):
    """Record of an axis under an unknown controller at `speed` (rad/s), and its nominal model."""
    t = np.arange(round(seconds * 500)) / 500.0
    x = speed * t + 0.3 * np.sin(2 * np.pi * 0.2 * t)
    acceleration = -0.3 * (2 * np.pi * 0.2) ** 2 * np.sin(2 * np.pi * 0.2 * t)
    random = np.random.default_rng(1).standard_normal(len(t))
    u = (J * acceleration - ripple(x) + FRICTION * np.sign(speed)) / K + noise * random
    columns = {"t": t, "ref": np.full_like(t, np.nan), "w": np.zeros_like(t), "u": u, "x": x}
    read = read_case({**CASE, **case}, ".")
    return check(columns, read), owner_model(read)


def test_many_turns_give_the_torque_ripple_with_its_band():
    record, model = spinning(3.0, 40.0, noise=0.2)
    found = over_turn(record, model)
    assert found.turns == pytest.approx(19, abs=1)
    assert found.angle.shape == found.torque.shape == found.band.shape == found.visits.shape == (PLACES,)
    assert found.visits.min() >= 17
    error = found.torque - ripple(found.angle)
    assert np.std(error) < 0.05 * np.std(ripple(found.angle))
    assert 0.85 < np.mean(np.abs(error) < found.band) < 1.0
    assert [o.order for o in found.orders[:2]] == [7.0, 12.0]
    assert found.orders[0].amplitude == pytest.approx(5e-3, rel=0.05)
    assert found.orders[0].share == pytest.approx(25 / 26, abs=0.03)


def test_torque_ripple_does_not_depend_on_the_direction():
    found = over_turn(*spinning(-3.0, 40.0))
    assert np.std(found.torque - ripple(found.angle)) < 0.05 * np.std(ripple(found.angle))


def test_unvisited_angles_have_no_torque():
    found = over_turn(*spinning(0.4, 10.0))
    assert 0.5 < found.turns < 0.7
    assert np.array_equal(np.isnan(found.torque), found.visits == 0)
    assert np.isnan(found.band[found.visits == 0]).all()
    known = found.visits > 0
    assert 0.4 * PLACES < known.sum() < 0.7 * PLACES
    off = (found.torque - ripple(found.angle))[known]
    assert np.std(off) < 0.1 * np.std(ripple(found.angle))
    assert (found.band[known] > 0).all()


def test_sliding_or_resting_axis_has_no_torque_ripple_map():
    record, model = spinning(3.0, 10.0)
    sliding = record.case._replace(sensors=record.case.sensors.model_copy(update={"unit": "m"}))
    assert over_turn(record._replace(case=sliding), model) is None
    still = record._replace(y={"x": np.zeros_like(record.t)})
    assert over_turn(still, model) is None
    assert over_turn(record._replace(y={"speed": record.y["x"]}), model) is None
