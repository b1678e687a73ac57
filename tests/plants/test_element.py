"""Elements and stands use one vocabulary of kinds and traits."""

import pytest

from rtctl.plants import axis, ivu, ldu
from rtctl.plants.element import KINDS, TRAITS, Element, Stand, element, stand

PLANTS = {"ivu": ivu, "ldu": ldu, "axis": axis}


def test_element_and_stand_parse_their_traits():
    assert element("reel1", "body", "turns reel") == Element("reel1", "body", frozenset({"turns", "reel"}))
    assert stand("sensor", "lone", usual=False) == Stand("sensor", frozenset({"lone"}), False, False)


@pytest.mark.parametrize("make", [lambda kind, traits: element("x", kind, traits), stand])
def test_unknown_kind_or_trait_is_refused(make):
    with pytest.raises(ValueError, match="there is no element 'gear'; there is body, joint, drive, sensor, loop"):
        make("gear", "")
    with pytest.raises(ValueError, match="a drive has no trait 'turns'; its traits are voltage, current, "):
        make("drive", "turns")
    with pytest.raises(ValueError, match="a loop has no trait 'fast'; its traits are none"):
        make("loop", "fast")


@pytest.mark.parametrize("kind", PLANTS)
def test_every_node_of_a_plant_has_an_element(kind):
    plant = PLANTS[kind]
    there = {k: {e.node for e in plant.ELEMENTS if e.kind == k} for k in KINDS}
    assert set(plant.DRIVES) == there["drive"]
    assert set(plant.SENSORS) == there["sensor"]
    assert set(plant.LINKS) - {"encoder"} <= there["joint"]
    assert set(plant.NODES) - {"encoder"} <= there["body"]
    assert len({(e.node, e.kind) for e in plant.ELEMENTS}) == len(plant.ELEMENTS)


def test_no_trait_has_the_name_of_a_machine():
    assert not {trait for traits in TRAITS.values() for trait in traits} & set(PLANTS)
