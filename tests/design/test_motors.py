"""Reel motors: the values of appendix E follow from K, R and I_0; a move needs a torque reserve."""

import math

import pytest

from rtctl.design import motors

PRINTED = {"706": 45.4, "707": 24.4, "708": 15.1, "709": 8.2, "711": 5.0}  # rpm without load


@pytest.mark.parametrize("motor", motors.APPENDIX_E, ids=lambda motor: motor.name)
def test_no_load_speed_is_that_of_appendix_e(motor):
    assert motor.no_load / motors.RPM == pytest.approx(PRINTED[motor.name[:3]], rel=0.05)
    assert motor.at(motor.no_load) == pytest.approx(0.0, abs=1e-12) and motor.at(0.0) == motor.most


def test_current_and_inertia_behind_a_gear():
    motor = motors.Motor("m", 10.0, 24.0, 10.0, 0.05, 0.1, 1e-6)
    assert motor.friction == pytest.approx(0.05) and motor.inertia == pytest.approx(1e-4)
    assert motor.current(0.45) == pytest.approx(1.0)  # (0.45 + 0.05) / (10 * 0.05)
    assert motor.stall == pytest.approx(10 * 0.05 * 2.4 - 0.05)


def test_peak_speed_and_acceleration_of_a_move():
    """x = d / 2 (1 - cos w t): v = d w / 2, a = d w^2 / 2."""
    found = motors.move(0.2, 2.0, 0.02)
    assert found.speed == pytest.approx(0.1 * math.pi / 2 / 0.02)
    assert found.acceleration == pytest.approx(0.1 * (math.pi / 2) ** 2 / 0.02) and found.torque == pytest.approx(2e-3)


def test_gear_that_the_tape_cannot_turn_does_not_fit():
    asked = motors.move(0.2, 10.0, 0.02)
    geared = motors.fit(motors.APPENDIX_E[1], asked, 0.02, 0.0)
    assert geared.left > 0 and geared.back > 10 and not geared.good
    assert motors.fit(motors.BRUSHLESS, asked, 0.02, 0.0).good
