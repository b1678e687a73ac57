"""Run `pytest` in this folder. Compiled code takes a named tuple and a numpy record here, as in the tick."""

import my_law
import numpy as np
import pytest

DT = 0.002  # s


def commands(errors, **settings):
    """Commands of the law in V for a series of errors in rad."""
    p = my_law.build(my_law.MyLawSettings(**{"gain": 30.0, **settings}), DT)
    s = np.zeros(1, my_law.MY_LAW_STATE)[0]
    my_law.reset(p, s)
    return np.array([my_law.step(p, s, float(e), 1) for e in errors])


def test_without_derivative_it_is_the_gain():
    assert commands([0.0, 0.1, -0.2]) == pytest.approx([0.0, 3.0, -6.0])


def test_a_ramp_ends_at_its_slope_times_tau_d():
    t = np.arange(500) * DT
    u = commands(2.0 * t, tau_d=0.1)
    assert u[-1] == pytest.approx(30.0 * (2.0 * t[-1] + 0.1 * 2.0))


def test_the_first_step_gives_no_kick():
    assert commands([0.5], tau_d=0.1)[0] == pytest.approx(30.0 * 0.5)


def test_a_negative_gain_is_refused():
    with pytest.raises(ValueError, match="gain"):
        my_law.MyLawSettings(gain=-1.0)
