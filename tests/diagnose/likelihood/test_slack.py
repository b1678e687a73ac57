import numpy as np
import pytest

from rtctl.diagnose.calibration import LAW_ERROR
from rtctl.diagnose.likelihood.slack import Slack, columns

POWER = 0.4


def some(n=60, k=5, seed=1):
    """Columns (n, k) of errors and innovations (n,)."""
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, k)), rng.standard_normal(n)


def test_slack_cost_equals_the_cost_of_the_full_covariance():
    white, r = some()
    slack = Slack(white, POWER)
    covariance = np.eye(len(r)) / POWER + white @ white.T  # covariance of weighted residuals
    stacked = slack.stacked(r)
    assert POWER * stacked @ stacked == pytest.approx(r @ np.linalg.solve(covariance, r))
    whole = np.linalg.slogdet(POWER * covariance)[1]
    assert POWER * slack.volume == pytest.approx(0.5 * whole)


def test_slack_of_many_residuals_equals_single_residuals():
    white, _ = some()
    slack = Slack(white, POWER)
    many = np.stack([some(seed=s)[1] for s in (2, 3)], axis=1)
    np.testing.assert_allclose(slack.stacked(many)[:, 1], slack.stacked(many[:, 1]))


def effect_and_speed():
    """Effect (blocks, 2), zero in the second sensor, and the speed (blocks,)."""
    t = np.arange(4000) / 500.0
    effect = 3.0 * np.sin(t * 7.0) + np.sin(90.0 * t)
    return np.stack([effect, np.zeros_like(t)], axis=1), np.cos(2.1 * t)


def unexplained(error, found):
    """Share of the power of an error (blocks,) outside the span of the columns (blocks, k)."""
    left = error - found @ np.linalg.lstsq(found, error, rcond=None)[0]
    return float(left @ left / (error @ error))


def test_law_error_is_a_share_of_the_effect():
    effect, speed = effect_and_speed()
    found = columns(effect, speed)
    np.testing.assert_allclose(found[:, 1], 0.0)
    spread = np.sqrt(np.mean(np.sum(found[:, 0] ** 2, axis=1)) / np.mean(effect[:, 0] ** 2))
    assert 0.5 * LAW_ERROR < spread < 2.0 * LAW_ERROR


@pytest.mark.parametrize("wrong", ["yields", "late", "by speed"])
def test_law_error_covers_curvature_delay_and_speed_dependence(wrong):
    effect, speed = effect_and_speed()
    one = effect[:, 0]
    error = {"yields": one**3, "late": np.roll(one, 1) - one, "by speed": one * speed}[wrong]
    assert unexplained(error, columns(effect, speed)[:, 0]) < 0.1
    other = np.sin(40.0 * np.arange(len(one)) / 500.0)  # a signal unrelated to the effect
    assert unexplained(other, columns(effect, speed)[:, 0]) > 0.9
