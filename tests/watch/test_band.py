"""Scores of a healthy machine have unit variance; a missing force raises the score of its regressor."""

import numpy as np
import pytest

from rtctl.config.errors import NoAnswer
from rtctl.watch.band import ALONG, FEWEST, learn
from rtctl.watch.windows import BLOCKS, Batch, Shape

SHAPE = Shape(1, 50, 0.002)
GRAIN = np.array([1e-4])


def windows(count, seed, force=lambda v, a: 0.0, speed=1.0):
    """Windows of one sensor: random-walk speed, white residuals and white forces."""
    rng = np.random.default_rng(seed)
    v = speed * np.cumsum(rng.standard_normal((count, BLOCKS, 1)) * 0.3, axis=1)
    a = np.diff(v, axis=1, prepend=np.zeros((count, 1, 1))) / 0.1
    e = 1e-4 * rng.standard_normal((count, 500, 1))
    push = 1e-3 * rng.standard_normal((count, BLOCKS, 1)) + force(v, a)
    return Batch(np.arange(count, dtype=float), e, push, v, a, np.zeros((count, BLOCKS)), np.zeros(count))


@pytest.fixture(scope="module")
def band():
    return learn(windows(600, 0, lambda v, a: 2e-3 * np.sign(v)), SHAPE, ["x"], [0], GRAIN)


def test_scores_of_a_healthy_machine_have_zero_mean_and_unit_variance(band):
    other = windows(400, 1, lambda v, a: 2e-3 * np.sign(v))
    scores = band.scores(other.some(band.counts(other)))
    assert np.abs(scores.mean(axis=0)).max() < 0.4
    assert (scores.std(axis=0) > 0.6).all() and (scores.std(axis=0) < 1.5).all()


def test_constant_model_error_is_learned_as_usual(band):
    assert band.usual[0, ALONG.index("direction")] == pytest.approx(2e-3, rel=0.2)


@pytest.mark.parametrize(
    ("force", "what"),
    [
        (lambda v, a: 2e-3 + 2e-3 * np.sign(v), "push+"),
        (lambda v, a: 1e-3 * np.sign(v), "direction-"),
        (lambda v, a: 2e-3 * np.sign(v) + 2e-3 * v, "speed+"),
        (lambda v, a: 2e-3 * np.sign(v) - 1e-3 * a, "acceleration-"),
    ],
)
def test_missing_force_raises_the_score_of_its_regressor(band, force, what):
    other = windows(200, 2, force)
    mean = band.scores(other.some(band.counts(other))).mean(axis=0)
    names = [m.what for m in band.signed()]
    signed = {n: s for n, s in zip(names, mean, strict=True) if n[-1] in "+-"}
    assert max(signed, key=signed.get) == what


def test_learning_refuses_too_little_motion():
    with pytest.raises(NoAnswer, match=f"{FEWEST} are needed"):
        learn(windows(300, 3, speed=1e-6), SHAPE, ["x"], [0], GRAIN)


def test_windows_faster_than_the_learned_range_or_late_are_not_scored(band):
    assert not band.counts(windows(50, 4, speed=20.0)).any()
    late = windows(50, 5)._replace(late=np.full(50, 1e-3))
    assert not band.counts(late).any()
    assert band.untimely(late).all()


def test_weight_of_a_repeated_motion_decreases(band):
    batch = windows(4, 6)
    batch.v[:] = 1.0
    batch.a[:] = 0.0
    weights, before = band.weights(batch)
    np.testing.assert_allclose(weights, [1.0, 1 / 2, 1 / 3, 1 / 4])
    assert band.weights(batch, before)[0][0] == pytest.approx(1 / 5)
