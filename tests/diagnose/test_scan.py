"""Closer looks: a resonance that is heavy and lies between the frequencies of the first look, a slack tape, a bump."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose import scan
from rtctl.diagnose.base import base_fit
from rtctl.diagnose.case import read_case
from rtctl.diagnose.find import proposed
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.kernel import CLOSED
from rtctl.diagnose.model import owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.record import Record
from rtctl.diagnose.scan import BUMP, PLACES, SLACK, TERM, bumps, resonances, slack
from rtctl.diagnose.screen import screen
from rtctl.diagnose.simulate import Simulator
from rtctl.plants.physics import TERMS, nodes

NARROW = {"term": BUMP, "node": "carriage", "F": 20.0, "at": 0.047, "width": 1.5e-3, "form": "hill"}
HEAVY = {"term": TERM, "node": "carriage", "mass": 40.0, "f_Hz": 14.5, "zeta": 0.04}


def scores(searched, axis):
    problem, base, _ = searched(axis)
    candidates = hypotheses(axis.record, base.model.base, only=(TERM, "load.spring"))
    return problem, base, screen(problem, base, candidates)


def test_a_heavy_resonance_is_met(make_axis, searched):
    problem, base, looked = scores(searched, make_axis(HEAVY))
    best = min(resonances(problem, base, looked), key=lambda f: f.merit)
    term = best.model.terms[0]
    assert (term.term, term.node) == (TERM, "carriage")
    assert term.f_Hz == pytest.approx(14.5, rel=0.02)
    assert term.mass == pytest.approx(40.0, rel=0.1)
    assert best.rms < 1.2 * problem.floor < 0.1 * base.rms


def test_without_a_hypothesis_of_one_there_is_nothing_to_look_for(plain, searched):
    problem, base, looked = scores(searched, plain)
    assert resonances(problem, base, [s for s in looked if s.hypothesis.term != TERM]) == []


def ivu_record(case, n, reference):
    """A record of the reel unit as its machine would leave it, by what makes the machine: a model of the owner's."""
    t, zero = 2e-3 * np.arange(n), np.zeros(n)
    names = ("capstan_counts", "reel1_counts", "reel2_counts")
    return Record("ivu", case, t, 2e-3, reference(t), zero, zero[:, None] * [0, 0], dict.fromkeys(names, zero), {})


def recorded(empty, true):
    """What the loop records of that machine."""
    out, volts, _ = Simulator(empty).everything(true, CLOSED)
    return Simulator(empty._replace(u=volts, y=dict(zip(empty.y, np.floor(out).T, strict=True))))


@pytest.mark.parametrize(
    ("kind", "there"), [("ivu", {"motor1", "reel1", "capstan", "reel2", "motor2"}), ("ldu", {"carriage"})]
)
def test_reels_are_looked_at_beside_their_motors(kind, there, monkeypatch):
    """A heavy part on a reel rings at a frequency that the first look does not meet, and on its motor explains little.
    The nodes of the linear drive move as one."""
    looked = [SimpleNamespace(hypothesis=SimpleNamespace(term=TERM, node=node)) for node in nodes(TERMS[TERM], kind)]
    problem = SimpleNamespace(sim=SimpleNamespace(record=SimpleNamespace(plant=kind)))
    tried = []
    monkeypatch.setattr(scan, "_tried", lambda problem, base, h: tried.append(h.node) or [])
    assert resonances(problem, None, looked) == []
    assert sorted(tried) == sorted(there)


def test_a_slack_tape_is_met_from_values_all_over_their_tolerance(case_of):
    """From the owner's the tape goes slack at other moments, and no slope leads to where it did."""
    case = read_case(case_of("ivu", controller__tension_N=0.04), ".")
    empty = ivu_record(case, 4000, lambda t: 6 * (1 - np.cos(2 * np.pi * 0.2 * t)) + 3 * np.sin(2 * np.pi * 1.1 * t))
    owner = owner_model(case)
    b = owner.base
    true = owner.change(K_m1=0.88 * b["K_m1"], K_m2=0.9 * b["K_m2"], tau_F1=1.1 * b["tau_F1"])
    true = true.add(TERMS[SLACK].settings(term=SLACK, node="tape1", share=1.0, other=1.0))
    sim = recorded(empty, true)
    problem = Problem(sim)
    base = base_fit(sim, problem)
    looked = screen(problem, base, hypotheses(sim.record, base.model.base, only=(SLACK, "drive.offset")))
    best = min(slack(problem, base, looked), key=lambda f: f.cost)
    assert {h.term for h in best.space.hypotheses} == {SLACK}
    assert best.rms < 0.3 * base.rms


def test_beside_an_effect_its_size_is_tried_too(plain, searched):
    """What an offset seems to be while the tape is thought to pull all the time is not what it is."""
    _, base, _ = searched(plain)
    offset, other = hypotheses(plain.record, base.model.base, only=("drive.offset", "timing.delay"))
    space = base.space.add(offset)
    model = base._replace(space=space, x=np.append(base.x, 2.0))
    xs = np.array(scan._all_over(model, other))
    assert xs.shape == (scan.ELSEWHERE, len(base.x) + 1 + len(other.coordinates))
    own = xs[:, len(base.x)]
    assert own.min() >= 0.0 and 4.0 < own.max() <= 2.0 * scan.LARGER
    assert len(np.unique(xs[:, 0])) == scan.ELSEWHERE
    np.testing.assert_array_equal(xs[0, len(base.x) + 1 :], other.start())


def test_a_tape_that_goes_slack_already_is_not_looked_for_again():
    slackened = SimpleNamespace(space=SimpleNamespace(hypotheses=[SimpleNamespace(term=SLACK)]))
    assert slack(None, slackened, []) == []


def test_a_narrow_bump_is_met_at_its_place_and_in_its_shape(make_axis, searched):
    axis = make_axis(NARROW)
    problem, base, _ = searched(axis)
    tried = bumps(problem, base, proposed(axis.sim, base))
    forms = [f.model.terms[0].form for f in tried]
    assert {f.model.terms[0].term for f in tried} == {BUMP}
    assert set(forms) == {"drag", "hill", "push"}
    assert max(forms.count(form) for form in forms) <= PLACES
    best = min(tried, key=lambda f: f.cost)
    term = best.model.terms[0]
    assert term.form == "hill"
    assert term.at == pytest.approx(0.047, abs=2e-4)
    assert term.F == pytest.approx(20.0, rel=0.1)
    assert best.rms < 1.2 * problem.floor < 0.4 * base.rms


def test_a_bump_that_a_model_has_is_not_looked_for_again(make_axis, searched):
    axis = make_axis(NARROW)
    problem, base, _ = searched(axis)
    likely = proposed(axis.sim, base)
    has = min(bumps(problem, base, likely), key=lambda f: f.cost)
    assert bumps(problem, has, likely) == []


def test_without_a_place_proposed_no_bump_is_fitted(plain, searched):
    problem, base, _ = searched(plain)
    assert bumps(problem, base, [h for h in proposed(plain.sim, base) if h.term != BUMP]) == []
