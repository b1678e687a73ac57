"""The closer look for a resonance: it meets one that is heavy and lies between the frequencies of the first look."""

import pytest

from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.scan import TERM, resonances
from rtctl.diagnose.screen import screen

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
