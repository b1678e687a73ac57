import numpy as np
import pytest
from graph_cases import PENDULUM, case_of, command, nothing, record

from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.slow import Slow, slow
from rtctl.diagnose.model.model import nominal

ONE = Slow(1, 4, 0.1, 0.1)


def residuals(size):
    """Residuals (40, 2), of which the second sensor's are constant by window, and as large as `size` in turns."""
    e = np.zeros((40, 2))
    e[:, 1] = np.repeat(size * np.array([1.0, -1.0] * 5), 4)
    return e


def test_windows_of_a_sensor():
    assert ONE.of(residuals(2.0)) == pytest.approx(2.0 * np.array([1.0, -1.0] * 5))
    assert ONE.of(np.zeros((41, 2, 3))).shape == (10, 3)


def test_a_residual_that_laws_may_leave_costs_little():
    assert ONE.losses(residuals(0.01), 1)[0] < 0.2
    assert ONE.told(residuals(0.01)).sigma == pytest.approx(0.1, rel=0.01)


def test_a_larger_one_costs_by_its_logarithm():
    one, two = (ONE.losses(residuals(size), 1)[0] for size in (10.0, 100.0))
    assert two - one == pytest.approx(10 * np.log(10.0), rel=1e-3)


def test_segments_sum_to_the_whole():
    e = residuals(0.3)
    assert ONE.losses(e, 5).sum() == pytest.approx(ONE.losses(e, 1)[0])


def test_the_followed_sensor_is_told_by_a_force():
    like = nothing().found.base.like
    (one,) = slow(like.sim, like.channels, like.mean)
    assert like.channels[one.column] == like.sim.column("encoder")
    push = one.least * like.sim.follow**2 * 9.8e-3  # Nm at the rod
    assert 0.001 < push / 0.4 < 0.1  # of what the drive makes


def test_a_slow_force_that_is_missing_costs_its_windows():
    u = command(4.0)
    pushed = 0.04 * np.sin(2 * np.pi * 0.3 * np.arange(len(u)) / 500.0)
    like, _ = together([record(case_of(PENDULUM), u, push=pushed)])
    e = like.raw(nominal(like.sim.case))
    (one,) = like.slow
    assert one.losses(e, 1)[0] > 10.0
    white = like.noisy(e).plain(e)
    assert np.std(white[-len(one.of(e)) :]) == pytest.approx(1.0, abs=0.2)
