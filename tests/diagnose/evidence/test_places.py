from copy import copy

import numpy as np
from graph_cases import named, nothing

from rtctl.diagnose.evidence.places import Place, axes, places
from rtctl.diagnose.model.node_scaling import Measures


def test_force_locations_are_independent_bodies_and_predicted_sensors():
    found = places(named().found.base)
    assert {p.node for p in found if not p.reads} <= {"motor", "carriage"}
    assert {p.node for p in found if p.reads} == {"encoder", "scale"}
    assert {p.axis for p in found if p.node == "scale"} == {"position", "command"}


def test_reading_error_does_not_change_the_simulated_motion():
    base = nothing().found.base
    sim, part = base.like.sim, base.like.parts[0]
    error = 0.01 * np.sin(np.arange(len(sim.seen)) / 50.0)
    place = Place("encoder", "time", [sim.record.t], 1.0, True)
    recorded = copy(sim)
    recorded.watched = sim.watched + error[:, None]
    leaks = copy(part)
    leaks.sim, leaks.target = recorded, part.target + error[:, None]
    assert np.abs(place.run(leaks, base.model, error, False) - part.raw(base.model)).max() < 1e-12


def test_reading_error_is_a_smooth_function_and_force_is_piecewise_linear():
    knots, hat = np.linspace(0.0, 1.0, 5), np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    x = np.linspace(-0.5, 1.5, 2001)
    bends = [
        np.abs(np.diff(Place("one", "position", [x], 1.0, reads).along(knots, hat, x), 2))[500:-500].max()
        for reads in (True, False)
    ]
    assert bends[0] < 0.02 * bends[1]


def test_location_axes_are_causal():
    base, k = nothing().found.base, 1000
    sim = base.like.sim
    other = copy(sim)
    other.watched = sim.watched + 0.01 * (np.arange(len(sim.watched)) > k)[:, None]  # from row k + 1 on
    told = [axes(Measures(one.seen_by(base.model), base.model.base, {}), "rod") for one in (sim, other)]
    for axis in ("velocity", "position"):
        assert (told[0][axis][: k + 1] == told[1][axis][: k + 1]).all()
        assert (told[0][axis][k + 2 : k + 20] != told[1][axis][k + 2 : k + 20]).any()
