from copy import copy

import numpy as np
from graph_cases import named, nothing

from rtctl.diagnose.evidence.places import Place, axes, places
from rtctl.diagnose.model.node_scaling import Measures


def test_places_are_bodies_that_move_on_their_own_and_sensors_that_are_predicted():
    found = places(named().found.base)
    assert {p.node for p in found if not p.reads} <= {"motor", "carriage"}
    assert {p.node for p in found if p.reads} == {"encoder", "scale"}
    assert {p.axis for p in found if p.node == "scale"} == {"position", "command"}


def test_an_error_of_a_reading_leaves_the_motion_of_the_machine():
    base = nothing().found.base
    sim, part = base.like.sim, base.like.parts[0]
    error = 0.01 * np.sin(np.arange(len(sim.seen)) / 50.0)
    place = Place("encoder", "time", [sim.record.t], 1.0, True)
    recorded = copy(sim)
    recorded.watched = sim.watched + error[:, None]
    leaks = copy(part)
    leaks.sim, leaks.target = recorded, part.target + error[:, None]
    assert np.abs(place.run(leaks, base.model, error, False) - part.raw(base.model)).max() < 1e-12


def test_an_error_of_a_reading_is_smooth_and_a_force_has_corners():
    knots, hat = np.linspace(0.0, 1.0, 5), np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    x = np.linspace(-0.5, 1.5, 2001)
    bends = [
        np.abs(np.diff(Place("one", "position", [x], 1.0, reads).along(knots, hat, x), 2))[500:-500].max()
        for reads in (True, False)
    ]
    assert bends[0] < 0.02 * bends[1]


def test_no_place_knows_of_a_step_before_the_sensor_shows_it():
    base, k = nothing().found.base, 1000
    sim = base.like.sim
    other = copy(sim)
    other.watched = sim.watched + 0.01 * (np.arange(len(sim.watched)) > k)[:, None]  # from the row after k on
    told = [axes(Measures(one.seen_by(base.model), base.model.base, {}), "rod") for one in (sim, other)]
    for axis in ("velocity", "position"):
        assert (told[0][axis][: k + 1] == told[1][axis][: k + 1]).all()
        assert (told[0][axis][k + 2 : k + 20] != told[1][axis][k + 2 : k + 20]).any()
