"""The errors that a fit sees: which rows and sensors count, and what they weigh."""

import numpy as np

from rtctl.diagnose.kernel import TRACK
from rtctl.diagnose.problem import Problem, main_channels, settled


def test_weights_weigh_errors_and_multiply(plain):
    problem, model = Problem(plain.sim), plain.model
    r = problem.residual(model)
    w = np.linspace(0.1, 1.0, len(r))
    np.testing.assert_allclose(problem.weighed(w).weighed(w).residual(model), w * w * r)
    np.testing.assert_array_equal(problem.residual(model), r)


def test_a_model_that_runs_away_is_a_large_but_finite_error(plain):
    problem = Problem(plain.sim)
    r = problem.residual(plain.model.change(k=-1e9))
    assert np.isfinite(r).all()
    assert np.abs(r).max() > 1e5


def test_rows_that_count_begin_once_the_machine_has_moved(plain):
    first = settled(plain.sim)
    seen = plain.sim.seen
    assert abs(seen[first] - seen[0]) > 0.01 * np.ptp(seen)
    assert first <= len(seen) // 5
    problem = Problem(plain.sim, stop=2000)
    assert len(problem.residual(plain.model)) == (2000 - first) // problem.mean
    assert Problem(plain.sim, stop=2000, mean=4).residual(plain.model).shape == ((2000 - first) // 4,)


def test_an_error_is_reading_less_simulation_by_half_a_step(plain):
    problem = Problem(plain.sim, mean=1)
    out = plain.sim.run(plain.model, TRACK)[:, 0]
    wanted = ((plain.record.y["x"] - out) / 1e-6)[problem.rows]
    np.testing.assert_allclose(problem.error(plain.model)[:, 0], wanted, rtol=1e-9, atol=1e-9)


def test_what_cannot_tell_direction_is_not_fitted():
    class Told:
        channels = ("capstan_counts", "reel1_counts", "reel2_counts")

    assert main_channels(Told()) == [0]  # type: ignore[arg-type]
    Told.channels = ("encoder_counts", "scale_counts")  # type: ignore[assignment]
    assert main_channels(Told()) == [0, 1]  # type: ignore[arg-type]
