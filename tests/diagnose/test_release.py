"""Free runs from the recorded state, and how far off a right model may be."""

import numpy as np
import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.case import NoLaw
from rtctl.diagnose.heldout import nrmse, refit, uncertain
from rtctl.diagnose.kernel import OPEN
from rtctl.diagnose.predict import predicts
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.release import let_go
from rtctl.diagnose.simulate import Simulator

CUT = 6000


@pytest.fixture(scope="module")
def moving(plain):
    """The second half of a recording: it begins in the middle of a motion, and no law is known."""
    record, first = plain.record, 1000
    cut = record._replace(
        t=record.t[first:] - record.t[first], ref=record.ref[first:], w=record.w[first:], u=record.u[first:],
        y={"x": record.y["x"][first:]}, case=record.case._replace(controller=NoLaw(), controller_known=True),
    )  # fmt: skip
    return Simulator(cut)


def test_a_free_run_begins_at_the_position_and_speed_that_the_record_shows(moving, plain):
    """From rest at zero a right model would be off by centimetres."""
    rows = slice(CUT, None)
    free = let_go(moving, plain.model, CUT)
    error = (free.run(plain.model)[:, 0] - moving.seen)[rows]
    assert np.abs(error).max() < 1e-3 * np.ptp(moving.seen)
    assert nrmse(moving, plain.model, rows, mode=OPEN) < 1e-3
    assert nrmse(moving, plain.model.change(M=130.0, F_c=5.0), rows, mode=OPEN) > 0.1


def test_before_the_release_the_model_is_on_track_and_the_state_is_moved_there(moving, plain):
    track = moving.run(plain.model)[:, 0]
    moved = moving.released(CUT, np.array([1e-3, 0.0])).run(plain.model)[:, 0]
    np.testing.assert_array_equal(moved[:CUT], track[:CUT])
    still = moving.released(CUT).run(plain.model)[:, 0]
    assert moved[CUT] - still[CUT] == pytest.approx(1e-3, rel=1e-6)


def test_a_right_model_predicts_as_its_uncertainty_says_and_a_wrong_one_does_not(moving, plain):
    problem, rows = Problem(moving), slice(CUT, None)
    fitted = refit(moving, problem, base_fit(moving, problem), CUT)
    assert predicts(problem, fitted, rows, nrmse(moving, fitted.model, rows, mode=OPEN), OPEN, False)
    far = 10.0 * uncertain(problem, fitted, rows, False)
    assert not predicts(problem, fitted, rows, far, OPEN, False)
    assert uncertain(problem, fitted, rows, True) >= uncertain(problem, fitted, rows, False)
