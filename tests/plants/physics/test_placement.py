"""Nodes of the terms on the three plants, against the table that preceded the traits."""

import pytest

from rtctl.plants.element import element
from rtctl.plants.physics import TERMS, by_kind, nodes, standing

SHAFTS = {"ivu": "motor1 motor2 reel1 reel2 capstan", "ldu": "motor wheel capstan carriage", "axis": "carriage"}
PLACES = (
    ("timing.delay timing.jitter", {"ivu": "loop", "ldu": "loop", "axis": "loop"}),
    (
        "drive.offset drive.deadband drive.gain_asymmetry drive.saturation drive.lag",
        {"ivu": "drive1 drive2", "ldu": "drive", "axis": "drive"},
    ),
    ("drive.supply_sag", {"ivu": "drive1", "ldu": "drive", "axis": "drive"}),
    ("drive.thermal", {"ivu": "drive1 drive2 motor1 motor2", "ldu": "drive carriage", "axis": "drive carriage"}),
    ("ripple.reel geometry.radius_change", {"ivu": "reel1 reel2"}),
    ("ripple.capstan", {"ivu": "capstan", "ldu": "capstan"}),
    ("transmission.backlash", {"ivu": "motor1 motor2", "ldu": "motor wheel capstan", "axis": "sensor"}),
    ("transmission.slip transmission.creep", {"ivu": "capstan", "ldu": "wheel capstan"}),
    ("friction.coulomb friction.viscous friction.quadratic friction.stribeck", SHAFTS),
    ("structure.resonance load.bump", SHAFTS),
    ("structure.stiffening", {"ivu": "tape1 tape2 motor1 motor2", "ldu": "wheel capstan", "axis": "carriage"}),
    ("tape.viscoelastic tape.slack", {"ivu": "tape1 tape2"}),
    ("friction.load", {"ivu": "capstan reel1 reel2 motor1 motor2", "ldu": "wheel capstan", "axis": "carriage"}),
    ("load.spring load.cable_chain", {"ldu": "carriage", "axis": "carriage"}),
    ("load.imbalance", {**SHAFTS, "ldu": "wheel capstan"}),
    ("friction.asymmetry friction.presliding", {"ivu": "motor1 motor2 capstan", "ldu": "carriage", "axis": "carriage"}),
    ("ripple.cogging", {"ivu": "motor1 motor2", "ldu": "motor", "axis": "carriage"}),
    ("ripple.encoder", {"ivu": "encoder", "ldu": "encoder", "axis": "sensor"}),
    ("guide.thickness guide.strip guide.dirt", {"ldu": "carriage scale", "axis": "sensor"}),
    (
        "sensor.missed_counts sensor.rectified sensor.scale",
        {"ivu": "encoder", "ldu": "encoder scale", "axis": "sensor"},
    ),
)
FROZEN = {
    name: {kind: tuple(n.split()) for kind, n in there.items()} for names, there in PLACES for name in names.split()
}


@pytest.mark.parametrize("name", TERMS)
def test_nodes_of_a_term_on_the_plants_are_frozen(name):
    """Later terms have no node on these plants."""
    assert by_kind(TERMS[name]) == FROZEN.get(name, {})


def test_nodes_of_a_term_follow_from_the_traits_of_the_elements():
    belt = (
        element("motor", "body", "turns driven dry"),
        element("carriage", "body", "slides load dry bounded"),
        element("belt", "joint", "spring shaft"),
        element("scale", "sensor", "position slides load"),
    )
    assert nodes(TERMS["ripple.cogging"], belt) == ("motor",)
    assert nodes(TERMS["load.spring"], belt) == ("carriage",)
    assert nodes(TERMS["transmission.backlash"], belt) == ("belt",)
    assert nodes(TERMS["ripple.encoder"], belt) == ()
    assert nodes(TERMS["friction.coulomb"], "no plant") == ()


def test_first_matching_stand_is_used():
    found = standing(TERMS["ripple.encoder"], "axis", "sensor")
    assert found is not None and not found[0].usual and found[1].kind == "sensor"
    found = standing(TERMS["ripple.encoder"], "ldu", "encoder")
    assert found is not None and found[0].usual
    assert standing(TERMS["ripple.encoder"], "ldu", "scale") is None
    assert standing(TERMS["guide.dirt"], "ldu", "scale")[0].again


def test_general_terms_are_offered_only_to_described_machines():
    drag, fan = TERMS["friction.quadratic"], (element("fan", "body", "turns general single"),)
    assert standing(drag, fan, "fan")[0].offered
    assert not any(standing(drag, kind, node)[0].offered for kind, there in by_kind(drag).items() for node in there)
    assert {name for name, term in TERMS.items() if not by_kind(term) and nodes(term, fan)} == {
        "friction.position", "load.gravity", "load.inertia"
    }  # fmt: skip


def test_supply_sag_is_offered_at_one_drive_in_both_ways():
    sag = TERMS["drive.supply_sag"]
    there = (element("one", "drive", "general force supply several"), element("two", "drive", "general force several"))
    assert [len(standing(sag, there, name)[0].ways) for name in ("one", "two")] == [2, 1]
    assert standing(sag, "axis", "drive")[0].ways == ()


def test_load_friction_is_offered_at_spring_loaded_and_heavy_bodies():
    there = tuple(element(name, "body", f"general turns {name}") for name in ("sprung", "heavy", "rotor"))
    assert nodes(TERMS["friction.load"], there) == ("sprung", "heavy")
