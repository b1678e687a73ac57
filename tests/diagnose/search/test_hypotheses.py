from functools import cache

import numpy as np
from graph_cases import BELT, PENDULUM, blank, case_of, command, record

from rtctl.diagnose.model.kernel import OPEN, kernel
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.hypotheses import hypotheses
from rtctl.diagnose.search.suggestions import hints
from rtctl.plants.physics import TERMS


@cache
def hypotheses_of(name):
    machine, u = {"belt": (BELT, 0.6), "pendulum": (PENDULUM, 4.0)}[name]
    sim = Simulator(record(case_of(machine), command(u)))
    return sim, {h.name for h in hypotheses(sim, nominal(sim.case))}


def test_hypothesis_nodes_are_names_of_the_description():
    sim, names = hypotheses_of("belt")
    machine = sim.case.machine
    there = {*machine.bodies, *machine.joints, *machine.drives, *machine.sensors, "loop"}
    assert {name.partition(":")[2] for name in names} <= there
    assert {"friction.coulomb:motor", "friction.coulomb:carriage", "transmission.backlash:belt"} <= names


def test_machine_without_joints_has_backlash_only_at_its_sensor():
    names = hypotheses_of("pendulum")[1]
    assert {name for name in names if name.startswith("transmission.")} == {"transmission.backlash:encoder"}


def test_weight_is_gravity_below_one_turn_and_imbalance_above():
    def weights(u):
        sim = Simulator(record(case_of(PENDULUM), command(u)))
        turns = np.ptp(sim.seen) / (2 * np.pi)
        names = {h.name for h in hypotheses(sim, nominal(sim.case))}
        return turns, names & {"load.gravity:rod", "load.imbalance:rod"}

    turns, names = weights(4.0)
    assert turns > 1.0 and names == {"load.imbalance:rod"}
    turns, names = weights(1.0)
    assert turns < 1.0 and names == {"load.gravity:rod"}


def test_comparative_sensor_terms_need_two_sensors():
    assert "sensor.scale:scale" in hypotheses_of("belt")[1]
    assert not any(TERMS[n.partition(":")[0]].needs.compared for n in hypotheses_of("pendulum")[1])


def test_hypothesis_terms_are_terms_of_the_kernel():
    assert {name.partition(":")[0] for name in hypotheses_of("belt")[1]} <= set(kernel().names)


def test_position_dependent_friction_needs_dry_friction():
    def positions(dry):
        parts = {**PENDULUM, "bodies": {"rod": {**PENDULUM["bodies"]["rod"], "dry": dry}}}
        sim = Simulator(record(case_of(parts), command(4.0)))
        return [h for h in hypotheses(sim, nominal(sim.case)) if h.term == "friction.position"]

    assert positions(0.01) and not positions(0.0)


SCREW = {
    "bodies": {"motor": {"inertia": 2e-4, "dry": 0.01}, "screw": {"inertia": 1e-4}, "table": {"mass": 20.0}},
    "joints": {"coupling": {"from": "motor", "to": "screw", "ratio": 1.0, "stiffness": 40.0, "damping": 0.02},
               "nut": {"from": "screw", "to": "table", "ratio": 1.6e-3}},
    "drives": {name: {"body": "motor", "column": name, "kind": "force", "gain": 0.05} for name in ("one", "two")},
    "sensors": {"encoder": {"body": "motor", "measures": "position", "column": "counts", "counts_per_unit": 1000.0},
                "scale": {"body": "table", "measures": "position", "column": "scale", "counts_per_unit": 1e6}},
}  # fmt: skip


@cache
def of_screw():
    u = command(4.0)
    still = blank(case_of(SCREW), u)._replace(u=np.stack([u, u], axis=1))
    model = nominal(still.case)
    moved = Simulator(still).run(model, mode=OPEN)
    sim = Simulator(still._replace(y={name: moved[:, k] for k, name in enumerate(still.y)}))
    waves = {"order:motor": [4.0], "order:screw": [4.0], "wavelength:table": [1e-3], "wavelength:scale": [1e-3]}
    return sim, hypotheses(sim, model, hints(sim, model, 100) | waves)


def test_hypotheses_of_a_ball_screw_have_the_documented_nodes():
    names = {h.name for h in of_screw()[1]}
    assert {f"ripple.cogging:{body}" for body in ("motor", "screw", "table")} <= names
    assert {f"friction.load:{body}" for body in ("motor", "screw")} <= names
    assert {f"transmission.{name}:coupling" for name in ("creep", "slip", "backlash")} <= names
    assert {"ripple.ratio:coupling", "ripple.ratio:nut", "transmission.backlash:nut"} <= names
    assert {"ripple.encoder:encoder", "ripple.encoder:scale", "drive.thermal:two"} <= names


def test_several_drives_have_common_and_separate_supply_hypotheses():
    feeds = {(h.node, h.fixed.get("feeds", "all")) for h in of_screw()[1] if h.term == "drive.supply_sag"}
    assert feeds == {("one", "all"), ("one", "own"), ("two", "own")}
    assert not any(
        "feeds" in h.fixed for h in hypotheses(hypotheses_of("belt")[0], nominal(hypotheses_of("belt")[0].case))
    )


def test_slip_limits_of_a_joint_follow_its_load():
    all_of_them = of_screw()[1]
    limits = sorted(h.coordinates[0].scale for h in all_of_them if h.name == "transmission.slip:coupling")
    assert len(limits) == 3 and 0.0 < limits[0] < limits[2] < 1.0  # Nm; the motor gives at most 0.5 Nm


def test_ripple_order_of_a_second_sensor_is_hinted():
    ripple = {"term": "ripple.encoder", "node": "second", "A": 0.02, "order": 5}
    second = {"body": "rod", "measures": "position", "column": "second", "counts_per_unit": 5000.0}
    pendulum = {**PENDULUM, "sensors": {**PENDULUM["sensors"], "second": second}}
    sim = Simulator(record(case_of(pendulum), command(4.0), [ripple]))
    found = hints(sim, nominal(sim.case), 100)["order:second"]
    assert np.isclose(found[0], 5.0, atol=0.3)


def test_friction_asymmetry_needs_motion_in_both_directions():
    made = record(case_of(BELT), command(0.6))
    one_way = Simulator(made._replace(y={name: np.maximum.accumulate(y) for name, y in made.y.items()}))
    names = {h.name for h in hypotheses(one_way, nominal(one_way.case))}
    assert "friction.asymmetry:carriage" not in names
    assert "friction.coulomb:carriage" in names
    assert "friction.asymmetry:carriage" in hypotheses_of("belt")[1]
