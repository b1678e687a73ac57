import numpy as np
import pytest

from rtctl.diagnose.graph.slack import OFF, Slack, columns

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


def test_an_error_is_a_share_of_what_the_effect_does():
    t = np.linspace(0.0, 20.0, 4000)
    effect = np.stack([3.0 * np.sin(t), np.zeros_like(t)], axis=1)
    found = columns(effect, np.cos(2.1 * t))
    spread = np.sqrt(np.sum(found**2, axis=2))  # of draws with standard deviation one
    np.testing.assert_allclose(spread[:, 1], 0.0)
    share = spread[:, 0] / np.maximum(np.abs(effect[:, 0]), 1e-9)
    assert 0.3 * OFF < share[np.abs(effect[:, 0]) > 0.1].min()
    assert share.max() < 1.01 * OFF
