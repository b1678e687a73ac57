import numpy as np
from graph_cases import CROSSTALK, misread, nothing, unnamed

from rtctl.diagnose.evidence.free import free_functions


def test_free_force_is_judged_by_the_residual_of_its_simulation():
    base = unnamed().found.base
    best = max(free_functions(base), key=lambda f: f.evidence)
    assert best.evidence > 0.0 and best.kind == "a force"
    like, model = base.like, base.model
    sim = like.sim
    force = best.over(0)[:, None]
    e = like.of_readings(sim.pushed(force).run(model))
    taken, told = np.mean(base.e**2) - np.mean(e**2), np.mean(base.e**2) - np.mean(best.e**2)
    assert told > 0.0
    assert taken > 0.3 * told  # the free fit also moves the base parameters


def test_nominal_machine_has_no_free_force_and_no_reading_error():
    assert all(f.evidence < 3.0 for f in free_functions(nothing().found.base))


def test_command_crosstalk_is_a_reading_error_that_depends_on_the_command():
    d = misread()
    free = d.decided.unlisted
    assert d.verdict == "unnamed"
    assert (free.node, free.axis, free.kind) == ("encoder", "command", "an error of the reading")
    slope = np.polyfit(free.knots, free.value, 1)[0]
    scale = d.record.case.machine.sensors["encoder"].scale
    assert abs(slope * scale / CROSSTALK - 1.0) < 0.2
    assert "encoder, by command" in d.headline
