"""A model that was found, in other forms and with fewer terms."""

from functools import partial

import numpy as np
import pytest

from rtctl.diagnose.base import base_fit
from rtctl.diagnose.decide import worth
from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.forms import richer
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.name import names
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.rework import drop, eliminate, enrich, plainer, polish
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis


@pytest.mark.parametrize("place", ["before", "behind"])
def test_a_useless_term_is_taken_out_and_the_useful_one_stays(tilted, searched, place):
    problem, base, looked = searched(tilted)
    found = looked.rounds[0][0]
    useless = Hypothesis("load.spring", "carriage", (Coordinate("k", SIZE, 20.0),))
    n = found.space.nb
    if place == "behind":
        both, x = found.space.add(useless), np.append(found.x, 0.0)
    else:
        both, x = found.space._replace(hypotheses=(useless, *found.space.hypotheses)), np.insert(found.x, n, 0.0)
    left = eliminate(problem, fit(problem, both, x), partial(worth, problem, base))
    assert names(left) == names(found)
    assert left.merit < 1.02 * found.merit


def test_dropping_a_hypothesis_takes_its_numbers_out_of_x(tilted, searched):
    _, base, _ = searched(tilted)
    one = Hypothesis("load.bump", "carriage", (Coordinate("F", SIZE, 1.0), Coordinate("at", "place", 1.0)))
    two = Hypothesis("drive.offset", "drive", (Coordinate("offset", SIZE, 1.0),))
    space = base.space.add(one, two)
    x = np.arange(float(space.nb + 3))
    held = Fit(space, x, base.r, base.J, base.cost)
    np.testing.assert_array_equal(drop(held, 0), [*range(space.nb), space.nb + 2])
    np.testing.assert_array_equal(drop(held, 1), range(space.nb + 2))


def test_polishing_never_makes_it_worse(tilted, searched):
    problem, _, looked = searched(tilted)
    for found in looked.rounds[0][:2]:
        assert polish(problem, found).cost <= found.cost * (1 + 1e-9)


def test_a_richer_form_that_does_as_well_as_a_second_name_takes_its_place(make_axis):
    """Notches of three harmonics: a push at a place follows some of what the first alone leaves."""
    notches = {"term": "ripple.cogging", "node": "carriage", "A": 4.0, "turn": 0.03, "A2": 1.2, "A3": 0.8, "phi2": 1.0}
    made = make_axis(notches)
    problem = Problem(made.sim)
    base = base_fit(made.sim, problem)
    hints = {"wavelength": [0.03], "spot": [0.05]}
    one, *_ = hypotheses(made.record, base.model.base, hints, only=("ripple.cogging",))
    bump, *_ = hypotheses(made.record, base.model.base, hints, only=("load.bump",))
    plain = fit(problem, base.space.add(one), np.append(base.x, one.start()))
    both = fit(problem, plain.space.add(bump), np.append(plain.x, bump.start()))
    assert both.cost < plain.cost
    left = eliminate(problem, both, lambda before, after: True)  # each name is worth having beside the plain form
    assert names(left) == ("ripple.cogging:carriage",)
    assert left.model.terms[0].A2 == pytest.approx(1.2, rel=0.2)
    assert left.cost < both.cost
    assert enrich(problem, plain, lambda before, after: False) is plain


def test_a_lag_that_never_swings_is_told_as_one_of_first_order(make_axis):
    made = make_axis({"term": "drive.lag", "node": "drive", "tau": 8e-3})
    problem = Problem(made.sim)
    base = base_fit(made.sim, problem)
    lags = {h.fixed["order"]: h for h in hypotheses(made.record, base.model.base, only=("drive.lag",))}
    rich = richer(made.record, base.model.base, lags[2])
    zeta = rich.coordinates[1]
    x = np.array([8e-3 / (2 * zeta.scale * np.exp(zeta.high)) / rich.coordinates[0].scale, zeta.high])
    held = fit(problem, base.space.add(rich), np.append(base.x, x), rounds=0)
    assert "drive.lag:drive.zeta" in held.bound()
    found = plainer(problem, held)
    (h,) = found.space.hypotheses
    assert h.fixed["order"] == 1 and found.merit < held.merit
    assert h.values(found.space.parts(found.x)[0])["tau"] == pytest.approx(8e-3, rel=0.05)
    assert plainer(problem, found) is found
