"""Where simulation and recording part, in words and numbers."""

from copy import copy

import numpy as np
import pytest

from rtctl.diagnose import locate
from rtctl.diagnose.fit import Fit
from rtctl.diagnose.locate import located, repeats, where
from rtctl.diagnose.name import Search
from rtctl.plants.physics import TERMS


def span(text):
    """The two numbers of `position 0.01 to 0.02 m`."""
    _, low, _, high, _ = text.split()
    return float(low), float(high)


def test_the_error_is_where_the_effect_that_was_found_stands(tilted, searched):
    problem, base, looked = searched(tilted)
    best = looked.rounds[0][0]
    told = located(tilted.sim, problem, base, best, looked)
    assert told.channel == "x"
    assert told.node == best.space.hypotheses[0].node
    assert told.axis == TERMS[best.space.hypotheses[0].term].axis
    assert told.share == pytest.approx(1.0 - best.cost / base.cost)
    assert told.share > 0.9
    assert problem.rows.start * tilted.record.dt <= told.since_s < 2.0


def test_without_a_name_the_nearest_one_tells_where(tilted, searched):
    problem, base, looked = searched(tilted)
    told = located(tilted.sim, problem, base, base, looked)
    assert told.node == looked.fits[0].space.hypotheses[0].node
    assert 0.0 <= told.share <= 1.0


def test_what_is_found_and_not_named_is_a_guess(tilted, searched, monkeypatch):
    problem, base, looked = searched(tilted)
    best = looked.rounds[0][0]
    asked = []
    monkeypatch.setattr(locate, "stands", lambda *a: asked.append(a[2:]) or "elsewhere")
    told = located(tilted.sim, problem, base, best, looked, named=False)
    assert told.node == "elsewhere"
    assert asked == [(best.space.hypotheses[0].node, told.share)]
    assert told.axis == (repeats(tilted.sim, base.model) or TERMS[best.space.hypotheses[0].term].axis)


def test_a_name_that_was_tried_tells_where_though_none_would_be_better(tilted, searched):
    problem, base, looked = searched(tilted)
    faint = looked.rounds[0][0]._replace(cost=0.99 * base.cost)  # less than its numbers cost
    told = located(tilted.sim, problem, base, base, looked._replace(rounds=((base, faint),)))
    assert (told.node, told.share) == ("carriage", pytest.approx(0.01))


def test_where_nothing_was_even_tried_it_is_the_body(tilted, searched):
    problem, base, _ = searched(tilted)
    told = located(tilted.sim, problem, base, base, Search(base, (), ()))
    assert (told.node, told.share) == ("carriage", 0.0)
    assert told.axis == (repeats(tilted.sim, base.model) or "time")


def test_ticks_off_their_times_are_the_loops(tilted, searched):
    problem, base, looked = searched(tilted)
    told = located(tilted.sim, problem, base, base, looked, ticks=True)
    assert (told.node, told.axis, told.share) == ("loop", "time", 1.0)


@pytest.mark.parametrize("begun", [0.0, 57.0])
def test_an_error_that_comes_late_is_there_since_then(tilted, searched, begun):
    problem, base, looked = searched(tilted)
    record = tilted.record._replace(t=tilted.record.t + begun)
    r = 0.1 * np.ones(len(base.r))
    r[4000:] = 100.0
    late = Fit(base.space, base.x, r, base.J, 0.5 * float(r @ r))
    sim = copy(tilted.sim)
    sim.record = record
    told = located(sim, problem, late, looked.rounds[0][0], looked)
    into = (problem.rows.start + 4000 * problem.mean) * record.dt
    assert told.since_s == pytest.approx(begun + into, abs=2e-3)  # by the recording's own clock


@pytest.mark.parametrize("axis", ["position", "velocity", "command", "time"])
def test_the_loud_part_of_an_axis_is_told(tilted, searched, axis):
    problem, _, _ = searched(tilted)
    x = tilted.record.y["x"]
    values = {"position": x, "velocity": np.gradient(x, 1e-3), "command": tilted.record.u[:, 0],
              "time": tilted.record.t}[axis][problem.rows]  # fmt: skip
    values = values[: len(values) // problem.mean * problem.mean].reshape(-1, problem.mean).mean(axis=1)
    low, high = np.quantile(values, [0.27, 0.36])
    error = np.where((values > low) & (values < high), 10.0, 0.1)
    told = where(tilted.sim, problem, error, axis)
    assert told.startswith(axis)
    a, b = span(told)
    assert a < high
    assert b > low


def test_an_error_everywhere_is_told_as_that(tilted, searched):
    problem, base, _ = searched(tilted)
    error = np.random.default_rng(0).standard_normal(len(base.r))
    assert where(tilted.sim, problem, error, "position") == "over all of the position"
    assert "over all" in where(tilted.sim, problem, error, "frequency")


def test_an_axis_without_values_of_its_own_is_told_by_time(tilted, searched):
    problem, base, _ = searched(tilted)
    error = np.full(len(base.r), 0.1)
    error[:300] = 10.0
    assert where(tilted.sim, problem, error, "frequency").startswith("time ")
    assert where(tilted.sim, problem, error, "frequency").endswith(" s")


@pytest.mark.parametrize(("term", "axis"), [
    ({"term": "load.bump", "node": "carriage", "F": 60.0, "at": 0.05, "width": 1e-2, "form": "push"}, "position"),
    ({"term": "friction.coulomb", "node": "carriage", "F_C": 20.0}, "velocity"),
])  # fmt: skip
def test_the_missing_force_tells_along_what_it_repeats(make_axis, term, axis):
    made = make_axis(term)
    assert repeats(made.sim, made.model._replace(terms=())) == axis
