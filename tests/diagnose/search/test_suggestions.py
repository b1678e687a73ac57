"""What a recording suggests to start from."""

from graph_cases import BELT, case_of, command, record

from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.hypotheses import hypotheses
from rtctl.diagnose.search.suggestions import hints


def test_order_of_a_ripple_is_hinted():
    ripple = {"term": "ripple.cogging", "node": "motor", "A": 0.03, "per_turn": 4}
    sim = Simulator(record(case_of(BELT), command(0.6), [ripple]))
    assert hints(sim, nominal(sim.case), 100)["order:motor"][0] == 4.0


def test_order_of_a_motor_that_pushes_unevenly_is_hinted_at_its_drive():
    ripple = {"term": "ripple.torque", "node": "amplifier", "A": 0.1, "per_turn": 6}
    sim = Simulator(record(case_of(BELT), command(0.6), [ripple]))
    model = nominal(sim.case)
    found = hints(sim, model, 100)
    assert found["order:amplifier"][0] == 6.0
    asked = {(h.name, h.fixed.get("per_turn")) for h in hypotheses(sim, model, found)}
    assert ("ripple.torque:amplifier", 6.0) in asked
