"""Between models that explain a record equally well: usual sizes, and nodes where a term usually stands."""

from types import SimpleNamespace

import numpy as np

from rtctl.diagnose.find import NEAR, RICH, deepened, most_likely, resembling, usual_nodes
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.model import Model
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis, Space
from rtctl.diagnose.verdict import Alternative

R = np.random.default_rng(0).standard_normal(3000)
PROBLEM = SimpleNamespace(floor=1.0, white=None)


def fitted(*terms, loud=1.0, size=0.1):
    hypotheses = tuple(Hypothesis(t, node, (Coordinate(name, SIZE, 1.0),)) for t, node, name in terms)
    space = Space(Model("ldu", {"M": 1.0}), (), lambda name: 0.1, hypotheses)
    r = loud * R
    return Fit(space, np.full(len(terms), size), r, np.zeros((len(r), len(terms))), 0.5 * float(r @ r))


SPRING = ("load.spring", "carriage", "k")
CAPSTAN, CARRIAGE = (("friction.stribeck", node, "F_s") for node in ("capstan", "carriage"))


def test_of_nodes_that_move_together_the_usual_one_is_told():
    best, other, rival = fitted(SPRING, CAPSTAN), fitted(CARRIAGE, SPRING), fitted(SPRING, loud=3.0)
    near = ((Alternative(rival, 0),), (Alternative(other, 0),))
    found, places = usual_nodes("ldu", best, near)  # type: ignore[arg-type]
    assert found is other
    assert [p.fit for p in places[0]] == [best]  # in the order of what was found, the former best among its rivals
    assert [p.fit for p in places[1]] == [rival]


def test_but_not_where_it_does_worse():
    best, other = fitted(CAPSTAN), fitted(CARRIAGE, loud=1.1)
    assert usual_nodes("ldu", best, ((Alternative(other, 0),),))[0] is best  # type: ignore[arg-type]
    usual = fitted(CARRIAGE)
    assert usual_nodes("ldu", usual, ((Alternative(fitted(CAPSTAN), 0),),))[0] is usual  # type: ignore[arg-type]


def test_of_equal_models_the_usual_size_goes_first():
    tilt = fitted(("friction.asymmetry", "carriage", "a"), size=0.95)
    push = fitted(("drive.offset", "drive", "offset"))
    assert most_likely(PROBLEM, tilt, ((Alternative(push, 0),),)) is push  # type: ignore[arg-type]
    assert most_likely(PROBLEM, push, ((Alternative(tilt, 0),),)) is push  # type: ignore[arg-type]


def test_what_looks_like_a_term_of_the_model_is_tried_in_its_place_again():
    wave = fitted(("ripple.capstan", "capstan", "a"), SPRING)
    names = ("ripple.encoder", "drive.offset", "friction.stribeck", "timing.delay")
    candidates = [Hypothesis(name, "capstan", (Coordinate("A", SIZE, 1.0),)) for name in names]
    assert [h.term for h in resembling(candidates, wave)] == ["ripple.encoder", "drive.offset"]
    assert resembling(candidates, fitted()) == []


def test_a_rival_whose_fit_ended_in_a_trough_is_tried_with_all_else_as_in_the_best(tilted, searched):
    problem, _, looked = searched(tilted)
    best, rival, *_ = looked.rounds[0]
    x = rival.x.copy()
    x[best.space.names.index("F_c")] -= 0.005
    r = problem.residual(rival.space.model(x))
    stuck = rival._replace(x=x, r=r, cost=0.5 * float(r @ r))
    assert NEAR * best.cost < stuck.cost < RICH * best.cost  # too far to be fitted to the bottom
    assert deepened(problem, stuck, best, 0).cost < 1.01 * rival.cost
    far = stuck._replace(cost=2.0 * RICH * best.cost)
    assert deepened(problem, far, best, 0) is far
