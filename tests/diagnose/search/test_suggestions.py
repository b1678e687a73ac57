"""Hints of a recording for the start values of hypotheses."""

import numpy as np
from graph_cases import BELT, PENDULUM, case_of, command, record

from rtctl.diagnose.model.model import nominal, settings_of
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.hypotheses import hypotheses
from rtctl.diagnose.search.suggestions import hints


def test_order_of_cogging_is_hinted():
    ripple = {"term": "ripple.cogging", "node": "motor", "A": 0.03, "per_turn": 4}
    sim = Simulator(record(case_of(BELT), command(0.6), [ripple]))
    assert hints(sim, nominal(sim.case), 100)["order:motor"][0] == 4.0


def test_order_of_torque_ripple_is_hinted_at_the_drive():
    ripple = {"term": "ripple.torque", "node": "amplifier", "A": 0.1, "per_turn": 6}
    sim = Simulator(record(case_of(BELT), command(0.6), [ripple]))
    model = nominal(sim.case)
    found = hints(sim, model, 100)
    assert found["order:amplifier"][0] == 6.0
    asked = {(h.name, h.fixed.get("per_turn")) for h in hypotheses(sim, model, found)}
    assert ("ripple.torque:amplifier", 6.0) in asked


def test_order_of_an_encoder_error_is_hinted_at_the_tracked_sensor():
    disc = {"term": "ripple.encoder", "node": "encoder", "A": 5e-3, "order": 4}
    sim = Simulator(record(case_of(PENDULUM), command(2.2), [disc]))
    model = nominal(sim.case)
    found = hints(sim, model, 100)
    assert np.ptp(sim.seen) < np.pi  # between a period of the error and half a turn
    assert found["order:encoder"][0] == 4.0
    asked = {(h.name, h.fixed.get("order")) for h in hypotheses(sim, model, found)}
    assert ("ripple.encoder:encoder", 4.0) in asked
    assert ("ripple.encoder:encoder", 1.0) not in asked


def test_hints_are_found_beside_backlash_at_the_only_sensor():
    bearing = {"from": "frame", "to": "rod", "ratio": 1.0, "stiffness": 0.5}
    sim = Simulator(record(case_of({**PENDULUM, "joints": {"bearing": bearing}}), command(2.2)))
    play = settings_of({"term": "transmission.backlash", "node": "encoder", "gap": 1e-3})
    assert "order:rod" in hints(sim, nominal(sim.case).add(play), 100)
