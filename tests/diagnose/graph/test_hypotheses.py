from functools import cache

import numpy as np
from graph_cases import BELT, PENDULUM, case_of, command, record

from rtctl.diagnose.graph.hypotheses import hints, hypotheses
from rtctl.diagnose.graph.kernel import kernel
from rtctl.diagnose.graph.model import nominal
from rtctl.diagnose.graph.simulate import Simulator
from rtctl.plants.physics import TERMS


@cache
def of(name):
    machine, u = {"belt": (BELT, 0.6), "pendulum": (PENDULUM, 4.0)}[name]
    sim = Simulator(record(case_of(machine), command(u)))
    return sim, {h.name for h in hypotheses(sim, nominal(sim.case))}


def test_nodes_are_the_names_of_the_description():
    sim, names = of("belt")
    machine = sim.case.machine
    there = {*machine.bodies, *machine.joints, *machine.drives, *machine.sensors, "loop"}
    assert {name.partition(":")[2] for name in names} <= there
    assert {"friction.coulomb:motor", "friction.coulomb:carriage", "transmission.backlash:belt"} <= names


def test_a_machine_without_a_spring_has_no_transmission():
    names = of("pendulum")[1]
    assert not {name for name in names if name.startswith("transmission.")}
    assert "load.gravity:rod" in names


def test_what_compares_sensors_needs_two():
    assert "sensor.scale:scale" in of("belt")[1]
    assert not any(TERMS[n.partition(":")[0]].needs.compared for n in of("pendulum")[1])


def test_terms_are_those_of_the_kernel():
    assert {name.partition(":")[0] for name in of("belt")[1]} <= set(kernel().names)


def test_order_of_a_ripple_is_hinted():
    ripple = {"term": "ripple.cogging", "node": "motor", "A": 0.03, "per_turn": 4}
    sim = Simulator(record(case_of(BELT), command(0.6), [ripple]))
    found = hints(sim, nominal(sim.case), 100)["order:motor"]
    assert np.isclose(found[0], 4.0, atol=0.3)


def test_friction_along_the_way_asks_for_dry_friction_that_it_alters():
    def positions(dry):
        parts = {**PENDULUM, "bodies": {"rod": {**PENDULUM["bodies"]["rod"], "dry": dry}}}
        sim = Simulator(record(case_of(parts), command(4.0)))
        return [h for h in hypotheses(sim, nominal(sim.case)) if h.term == "friction.position"]

    assert positions(0.01) and not positions(0.0)
