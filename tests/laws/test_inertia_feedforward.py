import numpy as np
import pytest

from rtctl.laws import inertia_feedforward

SETTINGS = inertia_feedforward.InertiaFeedforwardSettings(share=1.0, J=1.5e-3)


def volts(a, R1=0.038, R2=0.022, settings=SETTINGS):
    p = inertia_feedforward.build(settings, 0.002)
    s = np.zeros(1, inertia_feedforward.INERTIA_FEEDFORWARD_STATE)[0]
    inertia_feedforward.step(p, s, a, R1, R2)
    return s["u1"], s["u2"]


def test_feedforward_gives_each_reel_its_inertial_torque():
    u1, u2 = volts(10.0)
    torque_per_volt = 0.061 * 0.2
    assert u1 * torque_per_volt == pytest.approx(1.5e-3 * 10.0 * 0.0125 / 0.038)
    assert u2 * torque_per_volt == pytest.approx(-1.5e-3 * 10.0 * 0.0125 / 0.022)


def test_feedforward_is_odd_in_the_acceleration():
    assert volts(-3.0) == tuple(-np.array(volts(3.0)))


def test_share_of_zero_switches_the_feedforward_off():
    assert volts(10.0, settings=SETTINGS.model_copy(update={"share": 0.0})) == (0.0, 0.0)
