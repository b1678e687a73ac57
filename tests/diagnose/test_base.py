"""The owner's parameters come first: a wrong value is not missing physics."""

import numpy as np
import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.decide import complete
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import Simulator


def test_wrong_values_alone_are_explained_down_to_the_noise(plain, searched):
    problem, base, _ = searched(plain)
    assert base.space.hypotheses == ()
    assert complete(problem, base, base)
    assert base.space.owner.base["M"] == 95.0
    assert base.model.base["M"] / base.model.base["K"] == pytest.approx(100.0 / 35.0, rel=5e-3)


def test_missing_physics_is_not(tilted, searched):
    problem, base, _ = searched(tilted)
    assert not complete(problem, base, base)
    assert base.rms > 3 * problem.floor


def test_values_stay_within_what_the_owner_allows(tilted, searched):
    _, base, _ = searched(tilted)
    for name in base.space.names:
        assert 0.85 - 1e-9 <= base.model.base[name] / base.space.owner.base[name] <= 1.15 + 1e-9


def test_fitting_again_from_there_gains_next_to_nothing(tilted, searched):
    problem, base, _ = searched(tilted)
    again = base_fit(tilted.sim, problem)
    assert again.cost == pytest.approx(base.cost, rel=1e-9)


def test_where_nothing_may_move_the_owner_is_taken_at_his_word(plain):
    case = plain.record.case
    certain = case.reaches.model_copy(update={"parameter_tolerance": 0.0})
    exact = plain.record._replace(case=case._replace(reaches=certain))
    sim = Simulator(exact)
    found = base_fit(sim, Problem(sim))
    assert found.x.shape == (0,)
    assert found.model.base["M"] == 95.0
    assert np.isfinite(found.cost)
