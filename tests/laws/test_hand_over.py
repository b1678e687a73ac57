import pytest

from rtctl.laws import hand_over
from rtctl.laws.hand_over import HandOverParams

P = HandOverParams(trail_speed=0.5, hand_over=0.6)


def step(zero, *given):
    s = zero(hand_over.HAND_OVER_STATE)
    hand_over.step(P, s, *given)
    return s.u, s.u1, s.u2


def test_winding_motor_at_rest_compensates_a_share_of_the_friction_of_the_other(zero):
    assert step(zero, 0.2, 0.3, True, 0.0, 0.03, 0.02) == pytest.approx((0.2 + 0.6 * 0.3 * 1.5, 0.0, 0.0))
    assert step(zero, -0.2, -0.3, False, 0.0, 0.03, 0.02) == pytest.approx((-0.3 - 0.6 * 0.2 / 1.5, 0.0, 0.0))


def test_each_motor_compensates_its_friction_at_speed(zero):
    assert step(zero, 0.2, 0.3, True, 2.0, 0.03, 0.02) == pytest.approx((0.2, 0.0, -0.3))
    assert step(zero, -0.2, -0.3, False, -2.0, 0.03, 0.02) == pytest.approx((-0.3, -0.2, 0.0))
