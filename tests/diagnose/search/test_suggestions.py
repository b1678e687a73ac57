"""What a recording suggests to start from."""

from graph_cases import BELT, case_of, command, record

from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.suggestions import hints


def test_order_of_a_ripple_is_hinted():
    ripple = {"term": "ripple.cogging", "node": "motor", "A": 0.03, "per_turn": 4}
    sim = Simulator(record(case_of(BELT), command(0.6), [ripple]))
    assert hints(sim, nominal(sim.case), 100)["order:motor"][0] == 4.0
