import numpy as np
import pytest

from rtctl.laws import tension_estimate

K = 0.061 * 0.2  # Nm/V


def settle(u1, u2, v=0.0, acceleration=0.0, R1=0.038, R2=0.022, **settings):
    p = tension_estimate.build(tension_estimate.TensionEstimateSettings(**settings), 0.002)
    s = np.zeros(1, tension_estimate.TENSION_ESTIMATE_STATE)[0]
    for _ in range(2000):
        tension_estimate.step(p, s, u1, u2, v, acceleration, R1, R2)
    return s["T1"], s["T2"]


def test_estimate_at_rest_is_torque_over_radius():
    T1, T2 = settle(0.1 * 0.038 / K, 0.1 * 0.022 / K)
    assert T1 == pytest.approx(0.1) and T2 == pytest.approx(0.1)


def test_friction_lowers_the_winding_and_raises_the_paying_tension():
    T1, T2 = settle(0.0, 0.0, v=1.0, tau_F=2.4e-3)
    assert T1 == pytest.approx(-2.4e-3 / 0.038)
    assert T2 == pytest.approx(2.4e-3 / 0.022)
    assert settle(0.0, 0.0, v=-1.0, tau_F=2.4e-3) == (pytest.approx(-T1), pytest.approx(-T2))


def test_inertia_lowers_the_tension_of_the_accelerated_reel():
    T1, T2 = settle(0.0, 0.0, acceleration=10.0, J=1.5e-3)
    assert T1 == pytest.approx(-1.5e-3 * 10.0 * 0.0125 / 0.038**2)
    assert T2 == pytest.approx(1.5e-3 * 10.0 * 0.0125 / 0.022**2)


def test_estimate_attenuates_a_single_noisy_tick():
    p = tension_estimate.build(tension_estimate.TensionEstimateSettings(), 0.002)
    s = np.zeros(1, tension_estimate.TENSION_ESTIMATE_STATE)[0]
    tension_estimate.step(p, s, 3.0, 3.0, 0.0, 0.0, 0.038, 0.022)
    assert abs(s["T1"]) < 0.1 * 3.0 * K / 0.038
