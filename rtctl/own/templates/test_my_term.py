"""Run `pytest` in this folder."""

import my_term
import pytest

P = my_term.build(my_term.MyTermSettings(node="reel1", c=2e-4), 5e-4)


@pytest.mark.parametrize("v", [-30.0, -1e-3, 0.0, 2.0, 500.0])
def test_it_never_feeds_energy_in(v):
    assert my_term.drag(P, v) * v <= 0.0


def test_it_is_four_times_as_strong_at_twice_the_speed():
    assert my_term.drag(P, 6.0) == pytest.approx(4.0 * my_term.drag(P, 3.0))
