"""Any function in the place of a law: it takes what the law's form misses, and not what stands beside."""

import numpy as np
import pytest

from rtctl.diagnose.anylaw import HATS, abscissa, drives, freed, hats, static
from rtctl.diagnose.base import base_fit
from rtctl.diagnose.decide import no_form
from rtctl.diagnose.fit import fit
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import Hypothesis
from rtctl.diagnose.stretches import rms
from rtctl.plants.physics import TERMS

SPRING = {"term": "load.spring", "node": "carriage", "k": 600.0}
BUMP = {"term": "load.bump", "node": "carriage", "F": 3.0, "at": 0.03, "width": 0.012, "form": "push"}
BAND = {"term": "drive.deadband", "node": "drive", "band": 0.08}


@pytest.fixture(scope="module")
def fits(make_axis):
    """A problem with a spring and another term, fitted by the spring alone and by both."""

    def make(other):
        made = make_axis(SPRING, other, M=100.0)
        problem = Problem(made.sim)
        out = [base_fit(made.sim, problem)]
        for term in ("load.spring", other["term"]):
            starts = hypotheses(made.record, out[0].model.base, {"spot": [0.3]}, only=(term,))
            x = [(out[-1].space.add(h), np.append(out[-1].x, h.start())) for h in starts]
            out.append(min((fit(problem, space, start, rounds=12) for space, start in x), key=lambda f: f.cost))
        return problem, *out[1:]

    return make


def test_what_the_form_of_a_law_misses_is_no_other_effect(fits):
    problem, spring, both = fits(BUMP)
    assert both.cost < 0.3 * spring.cost
    least, other = freed(problem, spring, both)
    assert rms(least) < 0.5 * rms(spring.r)  # another function of the place does what the bump does
    assert rms(other) > 0.8 * rms(least)
    assert not no_form(problem, spring, both)


def test_what_no_function_of_the_place_does_is_another_effect(fits):
    problem, spring, both = fits(BAND)
    least, other = freed(problem, spring, both)
    assert rms(other) < 0.5 * rms(least)
    assert no_form(problem, spring, both)


def test_only_static_laws_are_set_free(fits):
    problem, spring, band = fits(BAND)
    along = {term.axis for term in TERMS.values() if term.static}
    assert along <= {"velocity", "command", "position", "angle"}
    assert static(spring) and static(band)
    (lag, *_) = hypotheses(problem.sim.record, spring.model.base, only=("drive.lag",))
    springy = spring._replace(space=spring.space.add(lag))
    assert not static(springy)
    assert not no_form(problem, springy, band)


def test_hats_sum_to_one_and_are_one_at_their_knots():
    values = np.random.default_rng(0).standard_normal(5000) ** 3
    found = hats(values)
    assert len(found) == HATS
    assert found.sum(axis=0) == pytest.approx(1.0)
    assert found.min() >= 0.0
    assert (np.abs(found).max(axis=1) > 0.9).all()
    assert len(hats(np.zeros(100))) == 1


@pytest.mark.parametrize(("plant", "node", "share"), [
    ("ivu", "motor1", (1.0, 0.0)), ("ivu", "drive2", (0.0, 1.0)), ("ivu", "capstan", (0.5, -0.5)),
    ("ldu", "carriage", (1.0,)), ("axis", "drive", (1.0,)),
])  # fmt: skip
def test_a_push_at_a_node_is_its_own_drives(blank, plant, node, share):
    sim = Simulator(blank(plant, np.ones((50, len(share)))))
    assert tuple(drives(sim, node)) == share


def test_a_law_is_seen_along_what_it_depends_on(moved):
    record, _ = moved("ivu")
    sim, model = Simulator(record), owner_model(record.case)
    angle = abscissa(sim, model, Hypothesis("ripple.cogging", "motor1", ()))
    assert angle.min() >= 0.0 and angle.max() < 2 * np.pi
    assert list(abscissa(sim, model, Hypothesis("drive.deadband", "drive2", ()))) == list(record.u[:, 1])
    x = abscissa(sim, model, Hypothesis("load.bump", "motor1", ()))
    v = abscissa(sim, model, Hypothesis("friction.coulomb", "motor1", ()))
    assert np.corrcoef(np.gradient(x), v)[0, 1] > 0.99
