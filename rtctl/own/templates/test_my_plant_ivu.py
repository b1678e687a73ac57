"""Run `pytest` in this folder."""

import my_plant
import numpy as np
import pytest

H = 5e-4  # s


def moved(pairs, **settings):
    """State after these pairs of voltages, one a substep."""
    p = my_plant.build(my_plant.MyPlantSettings(**settings), H)
    s = np.zeros(1, my_plant.MY_PLANT_STATE)[0]
    my_plant.start(p, s)
    for u1, u2 in pairs:
        my_plant.step(p, s, float(u1), float(u2))
    return s


def test_equal_pulls_leave_it_where_it_is():
    assert moved([(1.0, 1.0)] * 100)["capstan"] == 0.0


def test_it_ends_at_the_speed_at_which_friction_takes_the_torque():
    assert moved([(2.0, 0.5)] * 20_000, K=5e-3, B=2e-3)["w"] == pytest.approx(5e-3 * 1.5 / 2e-3, rel=1e-3)


def test_the_tape_that_leaves_one_reel_comes_to_the_other():
    s = moved([(1.0, 0.0)] * 1000, R1=0.038, R2=0.022, R_c=0.0125)
    assert 0.038 * s["reel1"] == pytest.approx(0.0125 * s["capstan"])
    assert 0.022 * s["reel2"] == pytest.approx(-0.0125 * s["capstan"])
