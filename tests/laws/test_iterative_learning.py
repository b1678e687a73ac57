import pytest

from rtctl.laws import iterative_learning
from rtctl.laws.reference import HOLD, PLAY

P = iterative_learning.build(iterative_learning.IterativeLearningSettings(duration=0.1, values=[0.0, 1.0, 3.0]), 0.001)


@pytest.mark.parametrize(("k", "u"), [(0, 0.0), (25, 0.5), (50, 1.0), (75, 2.0), (100, 0.0), (5000, 0.0), (-3, 0.0)])
def test_learned_values_are_interpolated_over_the_move_and_zero_afterwards(k, u):
    assert iterative_learning.step(P, PLAY, k, 0) == pytest.approx(u)


def test_learned_values_repeat_with_the_period():
    assert iterative_learning.step(P, PLAY, 275, 200) == pytest.approx(2.0)


def test_learned_feedforward_is_zero_while_the_reference_is_held():
    assert iterative_learning.step(P, HOLD, 75, 0) == 0.0
