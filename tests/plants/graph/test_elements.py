"""Elements and term locations of the shipped machines, from their descriptions."""

from types import SimpleNamespace

import pytest

from rtctl.plants import axis, ivu, ldu
from rtctl.plants.graph.elements import contacts, elements, spot
from rtctl.plants.graph.layout import NOWHERE
from rtctl.plants.physics import TERMS, nodes

PLANTS = {"ivu": ivu, "ldu": ldu}


def location(plant, term, node):
    machine = plant.described()
    return spot(TERMS[term], SimpleNamespace(node=node), machine.layout, elements(machine.layout), machine.values)


@pytest.mark.parametrize("name", PLANTS)
def test_description_of_a_plant_offers_every_node_of_its_terms(name):
    there = elements(PLANTS[name].described().layout)
    for term in TERMS.values():
        assert set(nodes(term, name)) <= set(nodes(term, there)), term.name


def test_linear_axis_lacks_only_the_terms_of_rotating_bodies():
    there = elements(axis.described().layout)
    for term in TERMS.values():
        missing = set(nodes(term, "axis")) - set(nodes(term, there))
        assert not missing or term.name in ("load.imbalance", "ripple.encoder")  # terms of rotating bodies


def test_tape_terms_are_located_at_the_capstan_and_its_spans():
    assert contacts(ivu.described().layout.machine)["capstan"].spans == ("tape1", "tape2")
    place = location(ivu, "transmission.slip", "capstan")
    assert (place.node, place.link, place.other) == (ivu.CAPSTAN, ivu.LINKS["tape1"], ivu.LINKS["tape2"])
    place = location(ivu, "ripple.capstan", "capstan")
    assert place.channel == NOWHERE  # no sensor rolls on the capstan
    place = location(ivu, "geometry.radius_change", "reel2")
    assert (place.link, place.other) == (ivu.LINKS["tape2"], ivu.LINKS["tape1"])
    place = location(ivu, "friction.load", "motor1")
    assert place.link == NOWHERE  # all springs at the motor load it
    place = location(ivu, "friction.load", "reel2")
    assert place.link == ivu.LINKS["tape2"]


def test_strip_contact_is_rigid_and_wheel_contact_is_compliant():
    machine = ldu.described().layout.machine
    assert {node: contact.joint for node, contact in contacts(machine).items()} == {
        "wheel": "motor",
        "capstan": "carriage",
    }
    strip, wheel = location(ldu, "transmission.slip", "capstan"), location(ldu, "transmission.slip", "wheel")
    assert (strip.link, strip.channel, strip.factor) == (NOWHERE, ldu.SENSORS["scale"], pytest.approx(3e-3))
    assert (wheel.link, wheel.channel) == (ldu.LINKS["wheel"], NOWHERE)
    assert location(ldu, "guide.thickness", "carriage").channel == ldu.SENSORS["scale"]
    assert location(ldu, "ripple.capstan", "capstan").channel == ldu.SENSORS["scale"]
