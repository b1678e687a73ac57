"""Elements and places of the machines that come with the program, from their descriptions."""

from types import SimpleNamespace

import pytest

from rtctl.plants import axis, ivu, ldu
from rtctl.plants.graph.elements import contacts, elements, spot
from rtctl.plants.graph.layout import NOWHERE
from rtctl.plants.physics import TERMS, nodes

PLANTS = {"ivu": ivu, "ldu": ldu}


def at(plant, term, node):
    machine = plant.described()
    return spot(TERMS[term], SimpleNamespace(node=node), machine.layout, elements(machine.layout), machine.values)


@pytest.mark.parametrize("name", PLANTS)
def test_every_term_of_a_plant_can_stand_on_its_description(name):
    there = elements(PLANTS[name].described().layout)
    for term in TERMS.values():
        assert set(nodes(term, name)) <= set(nodes(term, there)), term.name


def test_a_rotary_axis_has_what_turns_and_a_linear_one_what_slides():
    there = elements(axis.described().layout)
    for term in TERMS.values():
        missing = set(nodes(term, "axis")) - set(nodes(term, there))
        assert not missing or term.name in ("load.imbalance", "ripple.encoder")  # those of what turns


def test_tape_lies_around_the_capstan():
    assert contacts(ivu.described().layout.machine)["capstan"].spans == ("tape1", "tape2")
    place = at(ivu, "transmission.slip", "capstan")
    assert (place.node, place.link, place.other) == (ivu.CAPSTAN, ivu.LINKS["tape1"], ivu.LINKS["tape2"])
    place = at(ivu, "ripple.capstan", "capstan")
    assert place.channel == NOWHERE  # nothing rolls on it whose sensor it moves
    place = at(ivu, "geometry.radius_change", "reel2")
    assert (place.link, place.other) == (ivu.LINKS["tape2"], ivu.LINKS["tape1"])
    place = at(ivu, "friction.load", "motor1")
    assert place.link == NOWHERE  # all springs at it press
    place = at(ivu, "friction.load", "reel2")
    assert place.link == ivu.LINKS["tape2"]


def test_the_strip_is_rigid_and_the_wheel_a_spring():
    machine = ldu.described().layout.machine
    assert {node: contact.joint for node, contact in contacts(machine).items()} == {
        "wheel": "motor",
        "capstan": "carriage",
    }
    strip, wheel = at(ldu, "transmission.slip", "capstan"), at(ldu, "transmission.slip", "wheel")
    assert (strip.link, strip.channel, strip.factor) == (NOWHERE, ldu.SENSORS["scale"], pytest.approx(3e-3))
    assert (wheel.link, wheel.channel) == (ldu.LINKS["wheel"], NOWHERE)
    assert at(ldu, "guide.thickness", "carriage").channel == ldu.SENSORS["scale"]
    assert at(ldu, "ripple.capstan", "capstan").channel == ldu.SENSORS["scale"]
