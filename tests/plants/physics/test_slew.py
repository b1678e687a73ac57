import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rtctl.plants.physics.slew import SLEW_STATE, SlewSettings, bent, build_slew, slew

RATE, TAU, H = 50.0, 4e-3, 5e-4


def output(u, **settings):
    p, s = build_slew(SlewSettings(node="drive", **settings), H), np.zeros(1, SLEW_STATE).view(np.recarray)[0]
    out = []
    for value in u:
        slew(p, s, value)
        out.append(s.u)
    return np.array(out)


def test_smooth_slew_limit_matches_its_differential_equation():
    """y' = rate tanh((u - y) / (rate tau)), integrated by scipy."""
    u = np.repeat([0.05, 2.0, -1.0], 60)
    y, expected = 0.0, []
    for value in u:
        y = solve_ivp(
            lambda t, y, u=value: RATE * np.tanh((u - y) / (RATE * TAU)), (0.0, H), [y], rtol=1e-9, atol=1e-12
        ).y[0, -1]
        expected.append(y)
    assert output(u, rate=RATE, tau=TAU) == pytest.approx(np.array(expected), abs=1e-7)


def test_small_steps_give_a_lag_and_large_steps_a_ramp():
    small = output(np.full(40, 1e-4), rate=RATE, tau=TAU)
    assert small == pytest.approx(1e-4 * (1.0 - np.exp(-np.arange(1, 41) * H / TAU)), rel=1e-5)
    large = output(np.full(40, 1e4), rate=RATE, tau=TAU)
    assert large == pytest.approx(output(np.full(40, 1e4), rate=RATE), rel=1e-9)


@pytest.mark.parametrize("z", [0.0, 0.3, 5.0, 19.9, 20.1, 60.0])
def test_slew_decay_is_continuous_across_its_numerical_branches(z):
    assert bent(z, 0.0) == pytest.approx(z, abs=1e-12)
    assert bent(z, 0.2) == pytest.approx(bent(bent(z, 0.1), 0.1), abs=1e-12)
