"""What the table has no name for is not told by the names that it resembles."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose import beyond
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis, Space
from rtctl.plants.physics import TERMS

R = np.random.default_rng(0).standard_normal(3000)
RECORD = SimpleNamespace()


def fitted(*terms, loud=1.0):
    hypotheses = tuple(Hypothesis(t, "carriage", (Coordinate("size", SIZE, 1.0),)) for t in terms)
    space = Space(Model("axis", {"M": 1.0}), (), lambda name: 0.1, hypotheses)
    r = loud * R
    return Fit(space, np.full(len(terms), 0.1), r, np.zeros((len(r), len(terms))), 0.5 * float(r @ r))


@pytest.fixture
def found(monkeypatch):
    """What the fit with drag by the square of speed comes to."""

    def set_to(loud):
        drag = fitted("friction.quadratic", loud=loud)
        monkeypatch.setattr(beyond, "dropped", lambda problem, fit, index, rounds: fit)
        monkeypatch.setattr(beyond, "hypotheses", lambda record, base, only: list(drag.space.hypotheses))
        monkeypatch.setattr(beyond, "screen", lambda *_: [])
        monkeypatch.setattr(beyond, "look_alikes", lambda *_: [drag])
        monkeypatch.setattr(beyond, "polish", lambda problem, fit: fit)
        return drag

    return set_to


PROBLEM = SimpleNamespace(sim=SimpleNamespace(record=RECORD), block=20)
BOTH = "friction.viscous", "friction.stribeck"


def test_one_law_that_does_as_well_as_two_names_takes_their_place(found):
    drag = found(1.0)
    assert beyond.nameless(PROBLEM, fitted(loud=50.0), fitted(*BOTH)) is drag


def test_one_name_stands_unless_the_law_is_clearly_ahead(found):
    found(0.999)
    assert beyond.nameless(PROBLEM, fitted(loud=50.0), fitted("friction.viscous")) is None
    drag = found(0.5)
    assert beyond.nameless(PROBLEM, fitted(loud=50.0), fitted("friction.viscous")) is drag


def test_two_names_that_do_better_stand(found):
    found(1.2)
    assert beyond.nameless(PROBLEM, fitted(loud=50.0), fitted(*BOTH)) is None


def test_alone_it_takes_the_place_of_all_that_do_no_better(found):
    drag = found(1.0)
    some = fitted("drive.supply_sag", "guide.thickness", loud=1.01)
    assert beyond.nameless(PROBLEM, fitted(loud=50.0), some) is drag


def test_names_that_it_does_not_resemble_are_left_alone(found):
    found(0.1)
    assert beyond.nameless(PROBLEM, fitted(loud=50.0), fitted("load.spring")) is None


def test_none_of_them_is_in_the_table_and_all_they_resemble_is():
    told = {name: term for name, term in TERMS.items() if term.imitated}
    assert told
    for term in told.values():
        assert not term.tabled
        assert all(TERMS[other].tabled for other in term.imitated)
