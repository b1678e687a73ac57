"""The search: single effects, a pair, and what could stand in their place."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.diagnose import name
from rtctl.diagnose.decide import worth
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.name import (
    ROUNDS,
    Hopeless,
    absurd_last,
    best_starts,
    from_both,
    grow,
    held,
    lengths,
    names,
    roughly,
    shortlist,
    various,
)
from rtctl.diagnose.rework import eliminate
from rtctl.diagnose.screen import Score
from rtctl.diagnose.space import SHAPE, SIZE, Coordinate, Hypothesis

DEADBAND = {"term": "drive.deadband", "node": "drive", "band": 0.12}
SPRING = {"term": "load.spring", "node": "carriage", "k": 600.0}
ASYMMETRY = {"term": "friction.asymmetry", "node": "carriage", "a": 0.25}


def best(problem, base, looked):
    """As the chain takes it: another term has to be worth it."""
    found = base
    for level in looked.rounds:
        if worth(problem, base, found, level[0]):
            found = level[0]
    return eliminate(problem, found, partial(worth, problem, base)) if len(found.space.hypotheses) > 1 else found


def tilt(term):
    """Share of the dry friction, of an asymmetry or of the push of an offset, which is the same law."""
    return term.a if term.term == "friction.asymmetry" else -term.offset * 35.0 / 20.0


def test_asymmetric_friction_is_found_with_its_size(tilted, searched):
    problem, base, looked = searched(tilted)
    found = best(problem, base, looked)
    assert len(names(found)) == 1
    assert names(found)[0] in ("friction.asymmetry:carriage", "drive.offset:drive")
    assert tilt(found.model.terms[0]) == pytest.approx(0.25, rel=0.07)
    assert found.rms < 1.1 * problem.floor


def test_sizes_that_no_machine_has_come_last_however_well_they_fit(tilted, searched):
    _, base, _ = searched(tilted)
    (wave, *_) = hypotheses(tilted.record, base.model.base, {"wavelength": [0.05]}, only=("guide.thickness",))
    space = base.space.add(wave)
    real, absurd = (np.append(base.x, [size, 0.0, 0.0]) for size in (1.0, 1e6))
    fits = [Fit(space, x, base.r, base.J, cost) for x, cost in ((absurd, 1.0), (real, 2.0), (real, 3.0))]
    assert [f.cost for f in sorted(fits, key=absurd_last)] == [2.0, 3.0, 1.0]


def test_what_wants_to_be_something_else_is_no_ground_to_build_on(tilted, searched):
    _, base, _ = searched(tilted)
    tape = Hypothesis("tape.viscoelastic", "tape2", (Coordinate("tau", SHAPE, 1.2, -4.0, 3.0),))
    space = base.space.add(tape)
    fits = [Fit(space, np.append(base.x, tau), base.r, base.J, cost) for tau, cost in ((3.0, 1.0), (2.9, 2.0))]
    assert [f.cost for f in sorted(fits, key=partial(held, base))] == [2.0, 1.0]
    assert [f.cost for f in sorted(fits, key=partial(held, fits[0]))] == [1.0, 2.0]  # it was there before


def test_a_dead_band_is_found_with_its_size(make_axis, searched):
    problem, base, looked = searched(make_axis(DEADBAND, M=100.0, F_v=190.0))
    found = best(problem, base, looked)
    assert names(found) == ("drive.deadband:drive",)
    assert found.model.terms[0].band == pytest.approx(0.12, rel=0.05)


def test_a_pair_is_found_whole(make_axis, searched):
    problem, base, looked = searched(make_axis(DEADBAND, SPRING, M=100.0))
    found = best(problem, base, looked)
    assert len(names(found)) == 2
    spring, dead = sorted(found.model.terms, key=lambda t: t.term != "load.spring")
    assert spring.k == pytest.approx(600.0, rel=0.05)
    assert (dead.term, dead.band) == ("drive.deadband", pytest.approx(0.12, rel=0.1))


def test_a_spring_and_a_constant_push_are_two_things(make_axis, searched):
    """And not a spring that rests elsewhere, which would be the same law."""
    problem, base, looked = searched(make_axis(ASYMMETRY, SPRING, M=100.0))
    found = best(problem, base, looked)
    assert len(names(found)) == 2
    spring, other = sorted(found.model.terms, key=lambda t: t.term != "load.spring")
    assert spring.k == pytest.approx(600.0, rel=0.05)
    assert other.term in ("friction.asymmetry", "drive.offset")


def test_a_spring_may_rest_in_the_middle_of_the_travel(make_axis, searched):
    problem, base, looked = searched(make_axis({**SPRING, "x0": 0.04}))
    found = best(problem, base, looked)
    assert names(found) == ("load.spring:carriage",)
    assert found.model.terms[0].x0 == pytest.approx(0.04, abs=0.002)


def test_on_a_record_with_nothing_in_it_no_term_earns_its_place(plain, searched):
    problem, base, looked = searched(plain)
    assert best(problem, base, looked) is base


def test_every_combination_that_was_fitted_is_told_best_first(tilted, searched):
    _, base, looked = searched(tilted)
    merits = [f.merit for f in looked.fits]
    assert merits == sorted(merits)
    assert {len(f.space.hypotheses) for f in looked.rounds[0]} == {1}
    assert looked.base is base
    assert looked.scores


def scores(*told):
    made = [Hypothesis(t, n, (Coordinate("x", SIZE, 1.0),), {"start": i}) for i, (t, n, _) in enumerate(told)]
    return [Score(h, gain, np.zeros(1), 0.0, 1.0) for h, (_, _, gain) in zip(made, told, strict=True)]


def test_what_is_far_behind_is_not_tried_from_elsewhere(tilted, searched, monkeypatch):
    problem, base, looked = searched(tilted)
    trial = looked.rounds[0][0]
    from_where = []

    def well(problem, trial, x, best):
        from_where.append(x[: trial.space.nb].copy())
        return trial._replace(x=x, cost=2.0 if len(from_where) % 2 else 1.0)

    monkeypatch.setattr(name, "well", well)
    other = np.full(base.space.nb, 0.01)
    assert from_both(problem, trial, 1.0, other, limit=1.9).cost == 2.0
    assert len(from_where) == 1
    from_where.clear()
    assert from_both(problem, trial, 1.0, other, limit=2.1).cost == 1.0
    assert [list(x) for x in from_where] == [list(trial.x[: trial.space.nb]), list(other)]


def test_where_one_model_is_enough_the_next_start_is_not_screened(tilted, searched):
    problem, base, looked = searched(tilted)
    candidates = [h for h in hypotheses(tilted.record, base.model.base) if h.term == "friction.asymmetry"]
    told = []
    for enough, screened in ((lambda f: False, 2), (lambda f: True, 1)):
        told.clear()
        full, _ = grow(problem, [base, base], candidates, ROUNDS[0], base, enough, told.append)
        assert sum(text.startswith("screening") for text in told) == screened
        assert full[0].cost == pytest.approx(looked.rounds[0][0].cost, rel=0.02)


def test_waves_of_other_lengths_are_all_taken_to_their_richer_forms(tilted, searched, monkeypatch):
    """A plain wave that is not there may do better than the plain form of one that is."""
    problem, base, _ = searched(tilted)
    found = {"wavelength": [0.01, 0.011, 0.02]}  # of which the first two are the same
    waves = hypotheses(tilted.record, base.model.base, found, only=("ripple.cogging",))
    finished = []
    monkeypatch.setattr(name, "RICHER", 100.0)
    monkeypatch.setattr(name, "from_both", lambda problem, trial, *others: trial)
    monkeypatch.setattr(name, "finish", lambda problem, fitted, close: finished.append(lengths(fitted)) or fitted)
    full, _ = grow(problem, [base], waves, ROUNDS[0], None, lambda f: False, lambda text: None)
    assert len(finished) == len(set(finished)) == 2
    assert [names(f) for f in full] == [("ripple.cogging:carriage",)]


def test_a_shortlist_has_two_starts_of_one_and_three_nodes_of_one_at_most():
    told = [("a", "m1", 9.0)] * 3 + [("a", n, 8.0) for n in ("m2", "m3", "m4")] + [("b", "m1", 1.0), ("c", "m1", 0.0)]
    chosen = [(s.hypothesis.term, s.hypothesis.node) for s in shortlist(scores(*told), 20)]
    assert chosen == [("a", "m1"), ("a", "m1"), ("a", "m2"), ("a", "m3"), ("b", "m1")]
    assert len(shortlist(scores(*told), 2)) == 2


def test_later_rounds_try_the_best_starts_of_each():
    kept = best_starts(scores(*[("a", "m1", 9.0 - i) for i in range(6)], ("b", "m1", 1.0)))
    assert [h.term for h in kept] == ["a", "a", "a", "b"]
    assert [h.fixed["start"] for h in kept] == [0, 1, 2, 6]


def test_a_fit_far_behind_is_hopeless_only_after_some_rounds():
    hopeless = Hopeless(1.0, factor=5.0, rounds=3)
    assert [hopeless(100.0) for _ in range(4)] == [False, False, True, True]
    near = Hopeless(1.0, factor=5.0, rounds=3)
    assert not any(near(4.0) for _ in range(5))


def doing(cost, *names):
    """A fit of these terms at these nodes, by its cost alone."""
    hypotheses = tuple(Hypothesis(*name.split(":"), ()) for name in names)
    return SimpleNamespace(cost=cost, space=SimpleNamespace(hypotheses=hypotheses))


def test_full_fits_go_to_various_terms():
    """One term at nodes that move together would fill all of the places."""
    ranked = [
        doing(1.0, "drive.lag:drive", "guide.thickness:carriage"),
        doing(1.001, "drive.lag:drive", "guide.thickness:scale"),
        doing(1.2, "guide.thickness:carriage", "timing.delay:loop"),
        doing(1.2, "guide.thickness:scale", "timing.delay:loop"),
        doing(1.5, "drive.lag:drive", "guide.thickness:encoder"),  # does something else there
        doing(1.7, "drive.lag:drive", "ripple.capstan:capstan"),
        doing(1.8, "drive.lag:drive", "load.spring:carriage"),
    ]
    assert various(ranked, 4) == [ranked[i] for i in (0, 1, 2, 4, 5)]  # nodes of the best stay open
    assert various(ranked, 1) == ranked[:2]
    assert various([], 3) == []


def test_one_term_beside_equal_laws_fills_one_place():
    ranked = [
        doing(1.0, "drive.offset:drive1", "friction.stribeck:capstan"),
        doing(1.02, "friction.asymmetry:motor1", "friction.stribeck:capstan"),
        doing(1.5, "drive.offset:drive1", "friction.stribeck:motor2"),
        doing(1.55, "friction.asymmetry:motor1", "friction.stribeck:motor2"),
        doing(1.7, "drive.offset:drive1", "friction.stribeck:motor1"),
    ]
    assert various(ranked, 3) == [ranked[i] for i in (0, 1, 2, 4)]


def test_from_where_a_term_does_worse_than_nothing_less_of_it_is_tried(tilted, searched):
    problem, base, _ = searched(tilted)
    (band,) = hypotheses(tilted.record, base.model.base, only=("drive.offset",))
    far = Score(band, 1.0, np.append(base.x, 40.0), 0.0, 1.0)
    start = problem.residual(base.space.add(band).model(far.x))
    assert 0.5 * float(start @ start) > 10 * base.cost
    assert roughly(problem, base, far).cost < base.cost
