import numpy as np
from graph_cases import CROSSTALK, misread, nothing, unnamed

from rtctl.diagnose.evidence.free import free_functions


def test_a_force_counts_by_what_its_simulation_leaves():
    base = unnamed().found.base
    best = max(free_functions(base), key=lambda f: f.evidence)
    assert best.evidence > 0.0 and best.kind == "a force"
    like, model = base.like, base.model
    sim = like.sim
    force = best.over(0)[:, None]
    e = like.of_readings(sim.pushed(force).run(model))
    taken, told = np.mean(base.e**2) - np.mean(e**2), np.mean(base.e**2) - np.mean(best.e**2)
    assert told > 0.0
    assert taken > 0.3 * told  # the parameters of the base moved along with it


def test_a_machine_as_described_asks_for_neither_force_nor_error():
    assert all(f.evidence < 3.0 for f in free_functions(nothing().found.base))


def test_a_command_that_leaks_into_a_reading_is_an_error_of_that_reading_by_the_command():
    d = misread()
    free = d.decided.unlisted
    assert d.verdict == "unnamed"
    assert (free.node, free.axis, free.kind) == ("encoder", "command", "an error of the reading")
    slope = np.polyfit(free.knots, free.value, 1)[0]
    scale = d.record.case.machine.sensors["encoder"].scale
    assert abs(slope * scale / CROSSTALK - 1.0) < 0.2
    assert "encoder, by command" in d.headline
