from copy import copy

import numpy as np
from graph_cases import nothing, unnamed

from rtctl.diagnose.evidence.free import axes, free_forces
from rtctl.diagnose.model.node_scaling import Measures


def test_a_force_counts_by_what_its_simulation_leaves():
    base = unnamed().found.base
    best = max(free_forces(base), key=lambda f: f.evidence)
    assert best.evidence > 0.0
    like, model = base.like, base.model
    sim = like.sim
    along = axes(Measures(sim, model.base, {}), best.node)[best.axis]
    force = np.interp(along, best.knots, best.force)[:, None]
    e = like.of_readings(sim.pushed(force).run(model))
    taken, told = np.mean(base.e**2) - np.mean(e**2), np.mean(base.e**2) - np.mean(best.e**2)
    assert told > 0.0
    assert taken > 0.3 * told  # the parameters of the base moved along with it


def test_a_machine_as_described_asks_for_no_force():
    assert all(f.evidence < 3.0 for f in free_forces(nothing().found.base))


def test_no_force_knows_of_a_step_before_the_sensor_shows_it():
    base, k = nothing().found.base, 1000
    sim = base.like.sim
    other = copy(sim)
    other.watched = sim.watched + 0.01 * (np.arange(len(sim.watched)) > k)[:, None]  # from the row after k on
    told = [axes(Measures(one.seen_by(base.model), base.model.base, {}), "rod") for one in (sim, other)]
    for axis in ("velocity", "position"):
        assert (told[0][axis][: k + 1] == told[1][axis][: k + 1]).all()
        assert (told[0][axis][k + 2 : k + 20] != told[1][axis][k + 2 : k + 20]).any()
