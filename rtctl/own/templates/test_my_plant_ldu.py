"""Run `pytest` in this folder."""

import my_plant
import numpy as np
import pytest

H = 5e-5  # s


def moved(volts, **settings):
    """State after these voltages, one a substep."""
    p = my_plant.build(my_plant.MyPlantSettings(**settings), H)
    s = np.zeros(1, my_plant.MY_PLANT_STATE)[0]
    my_plant.start(p, s)
    for u in volts:
        my_plant.step(p, s, float(u))
    return s


def test_without_a_voltage_it_stays():
    s = moved([0.0] * 100)
    assert (s["scale"], s["v"]) == (0.0, 0.0)


def test_it_ends_at_the_speed_at_which_friction_takes_the_force():
    s = moved([2.0] * 20_000, M=1.0, K=35.0, F_v=200.0)
    assert s["v"] == pytest.approx(35.0 * 2.0 / 200.0)


def test_at_first_it_accelerates_as_a_free_mass():
    s = moved([1.0], M=95.0, K=35.0)
    assert s["v"] == pytest.approx(35.0 / 95.0 * H, rel=1e-2)
    assert s["scale"] == pytest.approx(0.5 * 35.0 / 95.0 * H**2, rel=1e-2)
