import numpy as np
import pytest
from graph_cases import PENDULUM, case_of, command, nothing, record

from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.slow import Slow, slow
from rtctl.diagnose.model.model import nominal

ONE = Slow(1, 4, 0.1, 0.1)


def residuals(size):
    """Residuals (40, 2); the second column is constant per window, alternating between +size and -size."""
    e = np.zeros((40, 2))
    e[:, 1] = np.repeat(size * np.array([1.0, -1.0] * 5), 4)
    return e


def test_slow_residual_is_the_window_mean_of_its_sensor():
    assert ONE.of(residuals(2.0)) == pytest.approx(2.0 * np.array([1.0, -1.0] * 5))
    assert ONE.of(np.zeros((41, 2, 3))).shape == (10, 3)


def test_slow_residual_within_the_law_error_costs_little():
    assert ONE.losses(residuals(0.01), 1)[0] < 0.2
    assert ONE.told(residuals(0.01)).sigma == pytest.approx(0.1, rel=0.01)


def test_cost_of_a_large_slow_residual_is_logarithmic():
    one, two = (ONE.losses(residuals(size), 1)[0] for size in (10.0, 100.0))
    assert two - one == pytest.approx(10 * np.log(10.0), rel=1e-3)


def test_slow_losses_of_segments_sum_to_the_loss():
    e = residuals(0.3)
    assert ONE.losses(e, 5).sum() == pytest.approx(ONE.losses(e, 1)[0])


def test_slow_residual_of_the_tracked_sensor_is_scaled_to_a_force():
    like = nothing().found.base.like
    (one,) = slow(like.sim, like.channels, like.mean)
    assert like.channels[one.column] == like.sim.column("encoder")
    push = one.least * like.sim.follow**2 * 9.8e-3  # Nm at the rod
    assert 0.001 < push / 0.4 < 0.1  # share of the drive torque


def test_missing_slow_force_costs_in_its_windows():
    u = command(4.0)
    pushed = 0.04 * np.sin(2 * np.pi * 0.3 * np.arange(len(u)) / 500.0)
    like, _ = together([record(case_of(PENDULUM), u, push=pushed)])
    e = like.raw(nominal(like.sim.case))
    (one,) = like.slow
    assert one.losses(e, 1)[0] > 10.0
    white = like.noisy(e).plain(e)
    assert np.std(white[-len(one.of(e)) :]) == pytest.approx(1.0, abs=0.2)
