"""Angle axes of the figures of a missing force."""

import numpy as np
import pytest

from rtctl.diagnose.answer.missing_force import of_turn


@pytest.mark.parametrize(("low", "high"), [(-1.5, 1.4), (1.0, 5.0), (7.0, 9.0), (3.0, 3.5)])
def test_angle_axis_of_less_than_a_turn_is_continuous(low, high):
    x = np.linspace(low, high, 200)
    shown = of_turn(x)
    assert np.diff(shown) == pytest.approx(np.degrees(np.diff(x)))
    assert abs(np.median(shown)) <= 180.0


def test_angle_axis_of_several_turns_is_wrapped():
    shown = of_turn(np.linspace(-20.0, 20.0, 5000))
    assert shown.min() >= 0.0 and shown.max() < 360.0
