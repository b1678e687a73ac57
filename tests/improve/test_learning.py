"""Iterative learning of a move, on a double integrator under PD control with an unknown force."""

import numpy as np
import pytest

from rtctl.improve import learning
from rtctl.laws import iterative_learning
from rtctl.laws.reference import PLAY

DT, K, GAIN, D = 0.001, 50.0, 20.0, 1.5
BY = learning.Learner(GAIN, D, 0.5 * DT, 12.0, DT, 2.0)


def tracking_error(values, push):
    """Tracking error (ticks,) over the move, with the learned values."""
    settings = iterative_learning.IterativeLearningSettings(duration=BY.duration, values=list(values))
    p = iterative_learning.build(settings, DT)
    x = v = 0.0
    error = []
    for k in range(round(BY.duration / DT)):
        ref = 0.5 - 0.5 * np.cos(np.pi * min(k * DT, 1.0))
        rate = 0.5 * np.pi * np.sin(np.pi * k * DT) if k * DT < 1.0 else 0.0
        u = GAIN * (ref - x) + D * (rate - v) + iterative_learning.step.py_func(p, PLAY, k, 0)
        a = K * (u + push(x))
        x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
        error.append(ref - x)
    return np.array(error)


@pytest.mark.parametrize("push", [lambda x: -0.8, lambda x: -0.5 * np.sin(9 * x), lambda x: -0.3 * (x > 0.4)])
def test_learning_reduces_the_rms_error_run_by_run(push):
    values, rms = np.zeros(learning.count(BY)), []
    for _ in range(7):
        error = tracking_error(values, push)
        rms.append(float(np.sqrt(np.mean(error**2))))
        values = learning.learned(BY, values, error)
    assert rms[1] < 0.5 * rms[0] and rms[-1] < 0.1 * rms[0]


def test_number_of_learned_values_follows_the_bandwidth_up_to_a_limit():
    assert learning.count(BY) == 8 * 12 * 2
    assert learning.count(BY._replace(duration=1000.0)) == iterative_learning.MOST
