"""Noise of a speed sensor, and speed sensors without direction."""

import numpy as np
import pytest
from known_records import at_rest, driven

from rtctl.case.format1 import read_case
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.model.format1 import resolution
from rtctl.diagnose.record.speed_sensor import folded, noise, signed
from rtctl.plants.physics import TERMS

RATE, ROWS, NOISE = 50.0, 500, 0.01
CASE = {
    "plant": "axis", "sample_rate": RATE, "parameters": {"M": 1.0, "F_v": 2.0}, "controller": {"kind": "none"},
    "drive": {"newton_per_volt": 4.0, "limit_volt": 10.0}, "reaches": {"parameter_tolerance": 0.5},
}  # fmt: skip
RINGS = TERMS["structure.resonance"].settings(node="carriage", f_Hz=1.7, mass=0.6, zeta=0.12)


def recorded(*terms, blind=False):
    """Record of the noisy speed of an axis with the given terms; `blind`: absolute speed."""
    u = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], ROWS // 5), 5)[:, None]
    case = read_case(CASE, ".")
    record = at_rest(case, ROWS, u=u, sensors=("speed",))
    speed = driven(record, owner_model(case).add(*terms))["speed"]
    shown = (np.abs(speed) if blind else speed) + NOISE * np.random.default_rng(1).standard_normal(ROWS)
    return record._replace(y={"speed": shown})


@pytest.mark.parametrize(("terms", "blind"), [((), False), ((RINGS,), False), ((RINGS,), True)])
def test_noise_level_is_the_residual_of_a_regression(terms, blind):
    """The estimate is within a factor of 2.5, also for a nonlinear machine."""
    record = recorded(*terms, blind=blind)
    found = noise(record.y["speed"], record.u)
    assert 0.8 * NOISE < found < 2.5 * NOISE
    assert resolution(record) == found


def test_few_or_constant_rows_give_no_noise_level():
    assert noise(np.ones(20), np.ones((20, 1))) == 0.0
    assert noise(np.zeros(200), np.zeros((200, 1))) == 0.0


def test_rectified_speed_gets_its_sign_from_the_command():
    true, record = recorded().y["speed"], recorded(blind=True)
    shown, u = record.y["speed"], record.u[:, 0]
    assert folded(shown, u) and not folded(true, u) and not folded(shown, np.abs(u))
    fast = np.abs(true) > 0.1
    assert np.mean(np.sign(signed(shown, u)[fast]) == np.sign(true[fast])) > 0.97
    np.testing.assert_array_equal(signed(true, u), true)
