"""Prediction: free runs on rows that no fit saw."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.case import NoLaw
from rtctl.diagnose.fit import fit
from rtctl.diagnose.heldout import (
    closed_on_track,
    closed_within,
    early,
    elsewhere,
    free_fit,
    holds_in_white,
    mode_of,
    nrmse,
    refit,
    rms,
)
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.kernel import CLOSED, OPEN, TRACK
from rtctl.diagnose.measure import begin, free_run
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import Simulator


def test_the_free_run_closes_the_loop_where_the_law_is_known_and_keeps_to_the_track_where_it_is_not(plain):
    case = plain.record.case
    assert mode_of(plain.record) == TRACK
    assert mode_of(plain.record._replace(case=case._replace(controller_known=True))) == CLOSED
    driven = case._replace(controller=NoLaw(), controller_known=True)
    assert mode_of(plain.record._replace(case=driven)) == OPEN


def test_the_true_model_predicts_and_a_wrong_one_does_not(plain):
    closed = Simulator(plain.record._replace(case=plain.record.case._replace(controller_known=True)))
    rows = slice(6000, None)
    good, bad = (nrmse(closed, m, rows) for m in (plain.model, plain.model.change(M=130.0, F_c=5.0)))
    assert good < 1e-4
    assert bad > 10 * good


def test_an_error_is_told_by_the_spread_of_the_whole_recording(make_axis):
    made = make_axis(step=0.0, M=100.0, F_v=180.0, F_c=22.0)
    spread, late = float(np.std(made.sim.seen)), np.arange(len(made.sim.seen)) >= 5000
    off = Simulator(made.record._replace(y={"x": made.record.y["x"] + 0.1 * spread * late}))
    off.record = made.record._replace(case=made.record.case._replace(controller=NoLaw(), controller_known=True))
    assert nrmse(off, made.model, slice(5000, None)) == pytest.approx(0.1, rel=1e-2)
    assert nrmse(off, made.model, slice(5000, 5100)) == pytest.approx(0.1, rel=1e-2)


def test_a_model_that_runs_away_predicts_nothing(plain):
    assert nrmse(plain.sim, plain.model.change(k=-1e9), slice(6000, None)) == 1e3


def test_a_fit_on_the_first_rows_does_not_see_the_last(tilted, searched):
    """It comes out the same when the last rows are something else altogether."""
    problem, _, looked = searched(tilted)
    found = looked.rounds[0][0]
    one = refit(tilted.sim, problem, found, 6000)
    y = tilted.record.y["x"].copy()
    y[6000:] = y[5999]
    u = tilted.record.u.copy()
    u[6000:] = 0.0
    spoiled = Simulator(tilted.record._replace(y={"x": y}, u=u))
    spoiled.follow = tilted.sim.follow
    two = refit(spoiled, problem, found, 6000)
    np.testing.assert_array_equal(one.x, two.x)
    assert len(one.r) < len(found.r)
    np.testing.assert_allclose(two.x, found.x, atol=0.1)


def test_a_limit_that_is_reached_once_at_the_beginning_is_too_faint_to_be_judged_by_the_end():
    late = np.arange(400) >= 300
    noise = np.random.default_rng(3).standard_normal(400)
    once, always = np.where(np.arange(400) < 20, 30.0, 0.3), np.full(400, 5.0)
    errors = {"right": noise, "once": noise + once, "always": noise + always, "late": noise + np.where(late, 9.0, 0.0)}
    problem = SimpleNamespace(time_rows=np.arange(400), residual=errors.get)
    right, *others = (SimpleNamespace(model=name) for name in errors)
    assert [early(problem, other, right, 300) for other in others] == [True, False, False]


def test_what_was_found_predicts_better_than_the_base(tilted, searched):
    problem, base, looked = searched(tilted)
    before, after = (
        nrmse(tilted.sim, refit(tilted.sim, problem, f, 6000).model, slice(6000, None))
        for f in (base, looked.rounds[0][0])
    )
    assert after < 0.2 * before


def known(made):
    """The recording's simulator as of a machine whose law is known."""
    return Simulator(made.record._replace(case=made.record.case._replace(controller_known=True)))


def wander(sim, model):
    """Rms of the free run's error under the recorded command, m."""
    return rms(free_run(sim, model, begin(sim, model))[:, 0] - sim.seen)


def test_a_free_run_that_drifts_is_asked_of_the_fit_as_well(make_axis):
    """A push that no term of the model has: friction takes some of it over once the free run counts."""
    sim = known(make_axis({"term": "load.spring", "node": "carriage", "k": 40.0}, M=100.0))
    on_track = base_fit(sim, Problem(sim))
    free = free_fit(sim, on_track)
    assert wander(sim, free.model) < 0.95 * wander(sim, on_track.model)
    problem = Problem(sim)
    assert rms(problem.residual(free.model)) < 1.5 * rms(problem.residual(on_track.model))


def test_a_term_gets_the_richer_form_that_the_free_run_asks_for(make_axis):
    tilt = {"term": "friction.asymmetry", "node": "carriage", "a": 0.1, "B_a": 40.0}
    sim = known(make_axis(tilt, M=100.0))
    problem = Problem(sim)
    base = base_fit(sim, problem)
    plain_form = next(h for h in hypotheses(sim.record, base.model.base, only=("friction.asymmetry",)))
    on_track = fit(problem, base.space.add(plain_form), rounds=20)
    assert on_track.model.terms[0].B_a == 0.0
    assert free_fit(sim, on_track).model.terms[0].B_a == pytest.approx(40.0, rel=0.2)


def test_where_the_law_is_not_known_the_track_is_all_there_is(plain):
    on_track = base_fit(plain.sim, Problem(plain.sim))
    assert free_fit(plain.sim, on_track) is on_track


def test_in_white_errors_a_model_holds_where_it_does_better_on_rows_that_no_fit_saw():
    rows, noise = np.arange(400), np.random.default_rng(0).standard_normal(400)
    white = SimpleNamespace(time_rows=rows, residual=lambda errors: errors)
    missing = 0.5 * np.sin(0.3 * rows)
    before, after = SimpleNamespace(model=noise + missing), SimpleNamespace(model=noise)
    only_early = SimpleNamespace(model=noise + np.where(rows < 300, 0.0, 1.5 * missing))
    assert holds_in_white(white, before, after, 300)
    assert not holds_in_white(white, before, only_early, 300)
    assert not holds_in_white(white, after, after, 300)


def test_where_a_machine_was_never_before():
    sim = SimpleNamespace(seen=np.concatenate([np.linspace(0, 3, 300), np.linspace(3, 5, 50), np.linspace(5, 2, 50)]))
    late = np.arange(400) >= 300
    assert elsewhere(sim, late) == pytest.approx(0.5 + 0.5 * 2 / 3, abs=0.02)
    assert elsewhere(sim, np.arange(400) < 100) == pytest.approx(1.0, abs=0.02)
    assert elsewhere(sim, ~late & (np.arange(400) >= 200)) == 0.0  # passed on the way back


def test_the_share_of_the_gap_is_that_of_errors_that_no_fit_saw():
    noise = np.random.default_rng(1).standard_normal(4000)
    unseen = np.arange(4000) >= 3000
    problem = SimpleNamespace(residual=lambda errors: errors)
    before, half = (
        SimpleNamespace(model=2.0 * noise),
        SimpleNamespace(model=np.where(unseen, np.sqrt(2.5), 1.0) * noise),
    )
    assert closed_on_track(problem, before, SimpleNamespace(model=noise), unseen) == pytest.approx(1.0, abs=0.1)
    assert closed_on_track(problem, before, half, unseen) == pytest.approx(0.5, abs=0.1)
    assert np.isnan(closed_on_track(problem, SimpleNamespace(model=noise), SimpleNamespace(model=noise), unseen))


def test_a_quarter_within_the_way_of_the_rest_bears_out_what_is_there(tilted, searched):
    problem, base, looked = searched(tilted)
    found = looked.rounds[0][0]
    assert closed_within(problem, base, found) > 0.9
    spoiled = found._replace(space=found.space.without(0), x=found.x[: found.space.nb])
    assert not closed_within(problem, base, spoiled) > 0.1
