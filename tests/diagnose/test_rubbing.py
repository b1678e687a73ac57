"""An owner who writes down no friction at all: the plain ones first, then what alters them."""

import numpy as np
import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.decide import complete, worth
from rtctl.diagnose.find import find, missed
from rtctl.diagnose.hypotheses import FALLING, hypotheses
from rtctl.diagnose.kernel import OPEN
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.name import key, new_starts
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import bears, dropped
from rtctl.diagnose.rubbing import BRISTLES, PLAIN, bare, rubbing, soft
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.uncertainty import covariance, effect_intervals
from rtctl.plants.physics import TERMS

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


HYSTERESIS = (
    {"term": "friction.coulomb", "node": "carriage", "F_C": 40.0},
    {"term": BRISTLES, "node": "carriage", "z_s": 9e-4},
)
OWNER = {"M": 2.0, "F_v": 10.0, "k": 5e4}


@pytest.fixture(scope="module")
def spring(blank):
    """A mass on a spring with hysteresis, of which its owner knows mass, damper and spring."""
    t, rng = np.arange(3000) / 750.0, np.random.default_rng(5)
    u = sum(4.0 * np.cos(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) for f in np.arange(5.0, 60.0, 1.0))
    changes = {
        "parameters": OWNER, "sample_rate": 750.0, "controller": {"kind": "none"}, "controller_known": False,
        "drive": {"newton_per_volt": 1.0, "limit_volt": 1e4}, "sensors": {},
    }  # fmt: skip
    empty = blank("axis", u * np.minimum(1.0, 15.0 * t), **changes)
    true = owner_model(empty.case).add(*(TERMS[p["term"]].settings(**p) for p in HYSTERESIS))
    x = Simulator(empty).run(true, OPEN)[:, 0] + 5e-7 * rng.standard_normal(len(t))
    return Problem(Simulator(empty._replace(y={"x": x})))


def test_bristles_that_bend_through_most_of_the_travel_come_with_their_friction(spring):
    base = base_fit(spring.sim, spring)
    proposed = hypotheses(spring.sim.record, base.model.base)
    best = min(soft(spring, base, proposed), key=lambda f: f.merit)
    assert terms(best) == {"friction.coulomb", BRISTLES}
    assert {t.term: t for t in best.model.terms}[BRISTLES].z_s == pytest.approx(9e-4, rel=0.05)
    assert complete(spring, base, best) and best.rms < 0.05 * base.rms
    assert soft(spring, best, proposed) == []


def test_the_search_tries_them(spring):
    assert terms(find(spring.sim, spring).best) == {"friction.coulomb", BRISTLES}


def test_no_soft_bristles_where_the_owner_knows_of_dry_friction(plain, searched):
    problem, base, _ = searched(plain)
    assert soft(problem, base, hypotheses(plain.record, base.model.base)) == []
