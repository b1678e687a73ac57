"""The errors that a fit sees: which rows and sensors count, and what they weigh."""

import numpy as np
from scipy.signal import lfilter

from rtctl.diagnose.kernel import TRACK
from rtctl.diagnose.problem import PARTED, Problem, main_channels, own_of, settled
from rtctl.diagnose.simulate import Simulator


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


def test_what_one_sensor_shows_alone_is_of_no_motion(blank):
    """Random forces show in both sensors of a linear drive, an uneven strip in its scale alone."""
    n = 20000
    reading = np.round(4000 * np.sin(np.arange(n) * 1e-3))
    problem = Problem(Simulator(blank("ldu", np.zeros((n, 1)), reading)))
    rng, floor = np.random.default_rng(1), problem.main_floor
    r = floor * rng.standard_normal(len(problem.order))
    assert not problem.parted(r)
    moves = 20.0 * floor * np.sin(np.arange(np.sum(problem.source == 0)) * 0.01)
    r[problem.source == 0] += moves
    r[problem.source == 1] += 1.6 * moves
    assert not problem.parted(r)
    gives = 1.4 * PARTED * floor * np.sqrt(2) * np.cos(np.arange(len(moves)) * 0.003)  # the springs between the two
    assert not problem.parted(r + np.where(problem.source == 1, np.resize(gives, len(r)), 0.0))
    r[problem.source == 1] += 2.5 * PARTED * floor * np.sqrt(2) * np.cos(np.arange(len(moves)) * 0.003)
    assert problem.parted(r)
    assert not problem.hiss(r)
    small = floor * rng.standard_normal(len(problem.order))
    small[problem.source == 1] += gives
    assert problem.parted(small)  # of what hardly moves no spring gives that much
    begun = floor * rng.standard_normal(len(problem.order)) + 40.0 * floor * (problem.source == 1)
    assert not problem.parted(begun)  # where the scale began to count is of no motion either, and of no physics


def test_random_forces_are_hiss_also_where_a_clock_makes_fast_readings_worth_less(blank):
    n = 40000
    problem = Problem(Simulator(blank("axis", np.zeros((n, 1)), 0.1 * np.sin(np.arange(n) * 1e-3))))
    rng, count = np.random.default_rng(3), len(problem.order)
    dt, w = problem.sim.record.dt * problem.mean, problem.sim.follow
    a = np.array([1.0, -2.0, 1.0]) / dt**2 + 1.4 * w * np.array([1.0, -1.0, 0.0]) / dt + np.array([w**2, 0.0, 0.0])
    e = lfilter([w**2], a, rng.standard_normal(count))
    e = problem.main_floor * (7.0 * e / np.std(e) + rng.standard_normal(count))
    worth = 1.0 / np.sqrt(1.0 + (6.0 * np.sin(np.arange(count) * 4e-3)) ** 2)
    assert problem.hiss(e)
    assert problem.allowing(worth).hiss(worth * e)
    assert not problem.weighed(worth).hiss(worth * e)
    late = 6.0 * np.sin(np.arange(count) * 4e-3) * rng.standard_normal(count)  # what makes them worth less
    assert problem.allowing(worth).hiss(worth * (e + problem.main_floor * late))


def test_one_sensor_has_nothing_to_differ_from(plain):
    problem = Problem(plain.sim)
    assert not problem.parted(100.0 * np.ones(len(problem.order)))


def test_an_axis_has_a_damper_and_a_spring_of_its_own(blank):
    u = np.zeros(100)
    axis = blank("axis", u, parameters={"M": 2.0, "F_v": 6.0, "k": 900.0}).case
    assert own_of(axis) == (3.0, 450.0)
    assert own_of(blank("ldu", u).case) == (0.0, 0.0)
