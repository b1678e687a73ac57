"""Shrinkage: sizes that the record hardly determines and that do not predict are no part of a model."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose import shrink
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis, Space


def tilted(a: float, B_a: float) -> Fit:
    """A fit of one term with two sizes, both 0.01 give or take."""
    h = Hypothesis("friction.asymmetry", "carriage", (Coordinate("a", SIZE, 1.0), Coordinate("B_a", SIZE, 1.0)))
    space = Space(Model("axis", {"M": 1.0}), (), lambda name: 0.1, (h,))
    return Fit(space, np.array([a, B_a]), np.ones(100), np.zeros((100, 2)), 50.0)


@pytest.mark.parametrize(("a", "quarters", "kept"), [(0.02, 2, False), (0.02, 4, True), (0.2, 2, True)])
def test_a_doubtful_size_stays_only_where_the_free_run_gains_by_it(monkeypatch, a, quarters, kept):
    monkeypatch.setattr(shrink, "covariance", lambda fitted, block: 1e-4 * np.eye(len(fitted.x)))
    monkeypatch.setattr(shrink, "fit", lambda problem, space, x, rounds: tilted(0, 0)._replace(space=space, x=x))
    monkeypatch.setattr(shrink, "runs_better", lambda problem, before, after: quarters)
    monkeypatch.setattr(shrink, "repeated", lambda problem, before, after: 1.0)
    found = shrink.shrunk(SimpleNamespace(block=10), tilted(a, 0.5))
    (term,) = found.fitted.model.terms
    assert (term.a == a) == kept and term.B_a == 0.5
    assert len(found.reasons) == (not kept)
    if not kept:
        assert "friction.asymmetry at carriage, a" in found.reasons[0] and "2 of 4" in found.reasons[0]


def test_a_term_without_any_sure_size_is_left_out(monkeypatch):
    monkeypatch.setattr(shrink, "covariance", lambda fitted, block: 1e-4 * np.eye(len(fitted.x)))
    monkeypatch.setattr(shrink, "fit", lambda problem, space, x, rounds: tilted(0, 0)._replace(space=space, x=x))
    monkeypatch.setattr(shrink, "runs_better", lambda problem, before, after: 0)
    found = shrink.shrunk(SimpleNamespace(block=10), tilted(0.01, 0.02))
    assert found.fitted.model.terms == () and len(found.reasons) == 2
