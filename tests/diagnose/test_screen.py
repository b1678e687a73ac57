"""The first look: the true one first, and no gain for what a wrong parameter explains as well."""

import numpy as np
import pytest

from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.screen import screen
from rtctl.diagnose.space import INVERSE, SIZE, Coordinate, Hypothesis

SPRING = {"term": "load.spring", "node": "carriage", "k": 600.0}
DEADBAND = {"term": "drive.deadband", "node": "drive", "band": 0.12}


@pytest.fixture(scope="module")
def scored(searched):
    def make(made):
        problem, base, _ = searched(made)
        return problem, base, screen(problem, base, hypotheses(made.record, base.model.base))

    return make


def test_what_is_there_comes_first_of_all(make_axis, scored):
    _, _, scores = scored(make_axis(SPRING, M=100.0))
    assert scores[0].hypothesis.name == "load.spring:carriage"
    size = scores[0].hypothesis.values(scores[0].x[4:])["k"]
    assert size == pytest.approx(600.0, rel=0.3)  # and about as large as it is


def test_friction_with_a_direction_comes_first_beside_its_look_alike(tilted, scored):
    """A constant push is the same in motion and has no kink: at first sight it does as well."""
    _, _, scores = scored(tilted)
    assert {s.hypothesis.term for s in scores[:2]} == {"friction.asymmetry", "drive.offset"}
    tilt = next(s for s in scores if s.hypothesis.term == "friction.asymmetry")
    assert tilt.hypothesis.values(tilt.x[4:])["a"] == pytest.approx(0.25, rel=0.3)


def test_a_dead_band_is_among_the_first_though_it_has_no_slope_at_zero(make_axis, scored):
    _, _, scores = scored(make_axis(DEADBAND, M=100.0, F_v=190.0))
    first = list(dict.fromkeys(s.hypothesis.term for s in scores))
    assert "drive.deadband" in first[:4]


def test_scores_come_best_first_and_gain_no_more_than_there_is(tilted, scored):
    _, base, scores = scored(tilted)
    gains = [s.gain for s in scores]
    assert gains == sorted(gains, reverse=True)
    assert 0.3 * base.cost < gains[0] <= base.cost * (1 + 1e-6)
    least = min(s.gain for s in scores if s.hypothesis.term != "friction.presliding")  # which cannot be none
    assert least > -1e-6 * base.cost


def test_what_equals_a_parameter_cannot_be_told_from_it(plain, scored):
    _, base, scores = scored(plain)
    same = {s.hypothesis.term: s for s in scores}
    for term in ("friction.viscous", "friction.coulomb"):
        assert same[term].overlap == pytest.approx(1.0, abs=0.02), term
        assert same[term].gain < 0.1 * base.cost  # what is left: it is free of what the owner says of the parameter
    assert same["load.spring"].overlap < 0.5
    assert same["friction.asymmetry"].overlap < 0.5


def test_a_predicted_point_is_within_the_bounds_of_its_space(tilted, scored):
    _, base, scores = scored(tilted)
    for s in scores:
        low, high = base.space.add(s.hypothesis).bounds()
        assert len(s.x) == len(low)
        shapes = [base.space.nb + i for i, c in enumerate(s.hypothesis.coordinates) if c.name == "z_s"]
        inside = (s.x >= low - 1e-9) & (s.x <= high + 1e-9)
        assert inside[[i for i in range(len(low)) if i not in shapes]].all(), s.hypothesis


def test_on_a_record_with_nothing_in_it_nothing_gains(plain, scored):
    _, base, scores = scored(plain)
    assert scores[0].gain < 0.15 * base.cost


def test_a_prediction_comes_true_where_the_effect_is_smooth(tilted, scored):
    problem, base, scores = scored(tilted)
    score = next(s for s in scores if s.hypothesis.term == "friction.asymmetry")
    r = problem.residual(base.space.add(score.hypothesis).model(score.x))
    assert base.cost - 0.5 * float(r @ r) > 0.5 * score.gain


def test_without_candidates_there_are_no_scores(tilted, searched):
    problem, base, _ = searched(tilted)
    assert screen(problem, base, []) == []


def test_one_that_runs_away_is_left_out_and_a_limit_is_tried_from_far(plain, searched):
    _, base, _ = searched(plain)
    away = Hypothesis("load.spring", "carriage", (Coordinate("k", SIZE, -1e12),))
    limit = Hypothesis("drive.saturation", "drive", (Coordinate("limit", INVERSE, 2.0, 0.0),))
    scores = screen(Problem(plain.sim), base, [away, limit])
    assert limit in [s.hypothesis for s in scores]
    assert all(np.isfinite(s.gain) for s in scores)


def test_what_is_there_or_not_may_do_any_much(make_axis, searched, monkeypatch):
    """A sensor without direction adds up all the way that a machine has gone, however long."""
    problem, base, _ = searched(make_axis({"term": "sensor.rectified", "node": "sensor", "share": 1.0}))
    blind = Hypothesis("sensor.rectified", "sensor", (), {"share": 1.0})
    candidates = [blind, *hypotheses(problem.sim.record, base.model.base, only=("load.spring",))]
    monkeypatch.setattr("rtctl.diagnose.screen.RUNAWAY", 0.0)
    scores = screen(problem, base, candidates)
    assert [s.hypothesis.term for s in scores] == ["sensor.rectified"]
