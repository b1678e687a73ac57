"""The owner's parameters come first: a wrong value is not missing physics."""

import numpy as np
import pytest

from rtctl.diagnose import base
from rtctl.diagnose.base import SPREAD, base_fit
from rtctl.diagnose.decide import complete
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import Space


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


@pytest.mark.parametrize(("left", "more"), [(1.0, 0), (2.0, SPREAD["axis"]), (9.0, 0)])
def test_near_the_noise_other_places_are_tried_as_well(plain, monkeypatch, left, more):
    tried = []

    def fit(problem, space, x, rounds=20):
        tried.append(x)
        better = 0.5 if len(tried) == 3 else 1.0
        r = np.full(50, left * problem.floor * np.sqrt(better))
        return Fit(space, space.start() if x is None else x, r, np.zeros((50, 3)), 0.5 * float(r @ r))

    monkeypatch.setattr(base, "fit", fit)
    monkeypatch.setattr(base, "settle", lambda problem, fitted: fitted)
    monkeypatch.setattr(base, "parallel", lambda jobs: [job() for job in jobs])
    found = base_fit(plain.sim, Problem(plain.sim))
    assert len(tried) == 1 + more
    assert (found.x == tried[2]).all() if more else (found.x == 0.0).all()


def test_places_to_start_from_are_within_the_tolerance_and_what_has_none_stays():
    space = Space(Model("axis", {"M": 1.0, "K": 2.0}), ("M", "K"), lambda name: 0.15 if name == "M" else np.inf)
    places = np.array(base.spread(space, np.array([0.1, 0.2]), 8))
    assert places.shape == (8, 2)
    assert (places[:, 1] == 0.2).all()
    assert np.log(0.85) < places[:, 0].min() < -0.05 < 0.05 < places[:, 0].max() < np.log(1.15)


def test_which_motor_is_the_heavier_and_where_a_mass_rings_are_troughs_to_begin_in():
    space = Space(Model("ivu", {"J_m1": 1.0, "J_m2": 1.0, "c1": 1.0}), ("J_m1", "J_m2", "c1"), lambda name: 0.15)
    one, two = base.pairs(space, np.array([0.0, 0.0, 0.07]), "ivu")
    up, down = 0.8 * np.log(1.15), 0.8 * np.log(0.85)
    assert one == pytest.approx([up, down, 0.07])
    assert two == pytest.approx([down, up, 0.07])
    assert len(base.pairs(Space(Model("ldu", {"M": 1.0}), ("M",), lambda name: 0.15), np.zeros(1), "ldu")) == 2
    assert base.pairs(Space(Model("axis", {"M": 1.0}), ("M",), lambda name: 0.15), np.zeros(1), "axis") == []
