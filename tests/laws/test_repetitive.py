import numpy as np
import pytest

from rtctl.laws import repetitive

DT = 0.001
SETTINGS = repetitive.RepetitiveSettings(period=2 * np.pi, gain=40.0, slow=0.1)


def turned(settings, turns, speed=3.0):
    """Largest residual disturbance in the last turn; the disturbance is periodic in the angle.

    The error of the law is the residual disturbance. Also returns parameters and state of the law.
    """
    p, s = repetitive.build(settings, DT), np.zeros(1, repetitive.REPETITIVE_STATE)[0]
    u, rest = 0.0, []
    for x in np.arange(0.0, turns * 2 * np.pi, speed * DT):
        left = 0.5 * np.sin(3 * x + 0.4) - u
        u = repetitive.step(p, s, x, speed, left)
        rest.append(left)
    return np.abs(rest[-round(2 * np.pi / speed / DT) :]).max(), p, s


def test_disturbance_periodic_in_the_angle_is_learned_turn_by_turn():
    most = [turned(SETTINGS, n)[0] for n in (1, 3, 8)]
    assert most[0] > 0.3 > 0.25 > most[1] > 3 * most[2]
    assert most[2] < 0.05


def test_nothing_is_learned_at_rest():
    p, s = repetitive.build(SETTINGS, DT), np.zeros(1, repetitive.REPETITIVE_STATE)[0]
    for _ in range(1000):
        assert repetitive.step(p, s, 1.0, 0.05, 0.3) == 0.0


def test_negative_positions_use_the_same_table():
    _, p, s = turned(SETTINGS, 4)
    assert repetitive.step(p, s, 1.0 - 6 * np.pi, 0.0, 0.0) == pytest.approx(repetitive.step(p, s, 1.0, 0.0, 0.0))


def test_reset_clears_the_learned_table():
    _, p, s = turned(SETTINGS, 2)
    repetitive.reset(p, s)
    assert not s["w"].any()
