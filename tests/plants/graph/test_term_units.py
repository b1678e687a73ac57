"""Units of the numbers of a term at a node."""

import pytest

from rtctl.plants.graph.description import Description
from rtctl.plants.graph.term_units import entry_in_si, unit_at
from rtctl.plants.physics.dimensions import DIMENSIONS

MACHINE = Description.model_validate({
    "bodies": {"motor": {"inertia": 1e-4}, "carriage": {"mass": 1.0}},
    "joints": {"belt": {"from": "motor", "to": "carriage", "ratio": 0.01}},
    "sensors": {"encoder": {"body": "motor", "column": "x"}},
})  # fmt: skip


@pytest.mark.parametrize(("node", "unit"), [("motor", "Nm"), ("carriage", "N")])
def test_a_unit_follows_from_whether_the_node_turns(node, unit):
    assert unit_at(MACHINE, "friction.coulomb", node, "F_C") == unit


def test_texts_with_units_become_si():
    entry = {"term": "friction.stribeck", "node": "motor", "F_s": "20 mNm", "v_s": "30 deg/s"}
    assert entry_in_si(MACHINE, entry) == pytest.approx({**entry, "F_s": 0.02, "v_s": 0.5235987756})
    given = {"term": "friction.quadratic", "node": "carriage", "Q": "2 N*s^2/m^2"}
    assert entry_in_si(MACHINE, given)["Q"] == 2.0


@pytest.mark.parametrize("value", [0.02, "0.02"])
def test_numbers_are_si(value):
    entry = {"term": "friction.coulomb", "node": "motor", "F_C": value}
    assert entry_in_si(MACHINE, entry)["F_C"] == 0.02


def test_a_unit_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="F_C: '3 N' is not a quantity in Nm"):
        entry_in_si(MACHINE, {"term": "friction.coulomb", "node": "motor", "F_C": "3 N"})


def test_every_unit_can_be_written():
    from rtctl.config.units import convert

    assert all(convert(1.0, unit, unit) == 1.0 for pair in DIMENSIONS.values() for unit in pair)
