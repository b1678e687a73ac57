"""An owner who writes down no friction at all: the plain ones first, then what alters them."""

import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.decide import complete, worth
from rtctl.diagnose.find import find, missed
from rtctl.diagnose.hypotheses import FALLING, hypotheses
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.name import key, new_starts
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import bears, dropped
from rtctl.diagnose.rubbing import PLAIN, bare, rubbing
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.uncertainty import covariance, effect_intervals

F_C, F_S = 20.0, 35.0  # N
STICKS = {"term": FALLING, "node": "carriage", "F_s": F_S, "v_s": 0.02}


@pytest.fixture(scope="module")
def problem(make_axis):
    """A carriage that sticks, of which the owner knows the mass alone."""
    record = make_axis(STICKS, F_c=F_C).record
    return Problem(Simulator(record._replace(case=record.case._replace(parameters={"M": 95.0}))))


@pytest.fixture(scope="module")
def found(problem):
    return find(problem.sim, problem)


def terms(fitted):
    return {h.term for h in fitted.space.hypotheses}


def test_both_plain_frictions_come_first(problem):
    base = base_fit(problem.sim, problem)
    fitted = rubbing(problem, base, hypotheses(problem.sim.record, base.model.base))
    assert terms(fitted) == set(PLAIN)
    assert worth(problem, base, base, fitted)
    assert all(value > 0.0 for h, x in zip(fitted.space.hypotheses, fitted.space.parts(fitted.x), strict=True)
               for value in h.values(x).values())  # fmt: skip


def test_an_owner_who_knows_of_friction_is_asked_as_ever(plain, searched):
    problem, base, _ = searched(plain)
    assert rubbing(problem, base, hypotheses(plain.record, base.model.base)) is None


def test_sticking_is_asked_about_once_there_is_dry_friction(problem):
    record, owner = problem.sim.record, owner_model(problem.sim.case)
    before = hypotheses(record, owner.base)
    rubs = next(h for h in before if h.term == "friction.coulomb")
    assert FALLING not in {h.term for h in before}
    after = hypotheses(record, owner.base, beside=[rubs.settings([2.0])])
    assert {h.term for h in new_starts(after, {key(h) for h in before})} == {FALLING}


def test_sticking_is_found_beside_them(problem, found):
    assert terms(found.best) == {FALLING, *PLAIN}
    assert complete(problem, found.base, found.best)


def test_its_size_counts_all_dry_friction_at_standstill(problem, found):
    index = next(i for i, h in enumerate(found.best.space.hypotheses) if h.term == FALLING)
    told = effect_intervals(found.best, index, covariance(found.best, problem.block))["F_s"]
    assert told.value == pytest.approx(F_S, rel=0.1)
    assert told.low < F_S < told.high


def test_what_sticking_falls_to_is_not_taken_from_under_it(found):
    best = found.best
    assert [h.term for i, h in enumerate(best.space.hypotheses) if bears(best, i)] == ["friction.coulomb"]
    falls = next(i for i, h in enumerate(best.space.hypotheses) if h.term == FALLING)
    alone = best._replace(space=best.space.without(falls))
    assert not any(bears(alone, i) for i in range(len(alone.space.hypotheses)))


def test_a_friction_without_which_nothing_could_be_told_is_missed(problem, found):
    viscous = next(i for i, h in enumerate(found.best.space.hypotheses) if h.term == "friction.viscous")
    less = dropped(problem, found.best, viscous, 10)
    assert missed(problem, found.base, less, found.best)
    assert not missed(problem, found.base, found.best, found.best)


def test_bare_is_an_axis_without_any_friction_of_the_owners(problem, plain, searched):
    assert bare(base_fit(problem.sim, problem))
    assert not bare(searched(plain)[1])
