import numpy as np
import pytest

from rtctl.diagnose.calibration import LAW_ERROR
from rtctl.diagnose.likelihood.slack import Slack, columns

POWER = 0.4


def some(n=60, k=5, seed=1):
    """Columns (n, k) of errors and innovations (n,)."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, k)), rng.standard_normal(n)


def test_the_cost_is_that_of_the_whole_covariance():
    white, r = some()
    slack = Slack(white, POWER)
    covariance = np.eye(len(r)) / POWER + white @ white.T  # of what counts for a share
    stacked = slack.stacked(r)
    assert POWER * stacked @ stacked == pytest.approx(r @ np.linalg.solve(covariance, r))
    whole = np.linalg.slogdet(POWER * covariance)[1]
    assert POWER * slack.volume == pytest.approx(0.5 * whole)


def test_many_residuals_at_once_are_as_each_alone():
    white, _ = some()
    slack = Slack(white, POWER)
    many = np.stack([some(seed=s)[1] for s in (2, 3)], axis=1)
    np.testing.assert_allclose(slack.stacked(many)[:, 1], slack.stacked(many[:, 1]))


def effect_and_speed():
    """An effect (blocks, 2) that the second sensor does not show, and the speed (blocks,) meanwhile."""
    t = np.arange(4000) / 500.0
    effect = 3.0 * np.sin(t * 7.0) + np.sin(90.0 * t)
    return np.stack([effect, np.zeros_like(t)], axis=1), np.cos(2.1 * t)


def unexplained(error, found):
    """Share of the power of an error (blocks,) that columns (blocks, k) leave."""
    left = error - found @ np.linalg.lstsq(found, error, rcond=None)[0]
    return float(left @ left / (error @ error))


def test_an_error_is_a_share_of_what_the_effect_does():
    effect, speed = effect_and_speed()
    found = columns(effect, speed)
    np.testing.assert_allclose(found[:, 1], 0.0)
    spread = np.sqrt(np.mean(np.sum(found[:, 0] ** 2, axis=1)) / np.mean(effect[:, 0] ** 2))
    assert 0.5 * LAW_ERROR < spread < 2.0 * LAW_ERROR


@pytest.mark.parametrize("wrong", ["yields", "late", "by speed"])
def test_a_law_may_be_wrong_in_curvature_time_and_speed(wrong):
    effect, speed = effect_and_speed()
    one = effect[:, 0]
    error = {"yields": one**3, "late": np.roll(one, 1) - one, "by speed": one * speed}[wrong]
    assert unexplained(error, columns(effect, speed)[:, 0]) < 0.1
    other = np.sin(40.0 * np.arange(len(one)) / 500.0)  # what the effect does not do
    assert unexplained(other, columns(effect, speed)[:, 0]) > 0.9
