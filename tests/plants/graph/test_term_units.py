"""Units of the parameters of a term at a node."""

import pytest

from rtctl.plants.graph.description import Description
from rtctl.plants.graph.term_units import body_of, ends_turn, entry_in_si, turns_at, unit_at
from rtctl.plants.physics.dimensions import DIMENSIONS

MACHINE = Description.model_validate({
    "bodies": {"motor": {"inertia": 1e-4}, "carriage": {"mass": 1.0}},
    "joints": {"belt": {"from": "motor", "to": "carriage", "ratio": 0.01}},
    "sensors": {"encoder": {"body": "motor", "column": "x"}},
})  # fmt: skip


@pytest.mark.parametrize(("node", "unit"), [("motor", "Nm"), ("carriage", "N")])
def test_unit_depends_on_a_rotating_or_sliding_node(node, unit):
    assert unit_at(MACHINE, "friction.coulomb", node, "F_C") == unit


@pytest.mark.parametrize(("size", "unit"), [("inertia", "Nm"), ("mass", "N")])
@pytest.mark.parametrize("ends", [("frame", "part"), ("part", "frame"), ("wall", "part"), ("part", "wall")])
@pytest.mark.parametrize("wall", ["inertia", "mass"])
def test_joint_to_the_frame_has_the_unit_of_its_moving_body(size, unit, ends, wall):
    machine = Description.model_validate({
        "bodies": {"part": {size: 1.0}, "wall": {wall: 1.0, "fixed": True}},
        "joints": {"spring": {"from": ends[0], "to": ends[1], "stiffness": 10.0}},
        "drives": {"coil": {"joint": "spring"}},
        "sensors": {"gauge": {"joint": "spring", "measures": "force", "column": "f"},
                    "shunt": {"drive": "coil", "measures": "current", "column": "i"},
                    "scale": {"body": "part", "column": "x"}},
    })  # fmt: skip
    assert {body_of(machine, node) for node in ("spring", "coil", "gauge", "shunt")} == {"part"}
    assert unit_at(machine, "transmission.hysteresis", "spring", "F_h") == unit
    assert ends_turn(machine, "spring") == (unit == "Nm", unit == "Nm")


def test_sensor_with_the_name_of_another_body_keeps_its_unit():
    machine = Description.model_validate({
        "bodies": {"motor": {"inertia": 1e-4}, "carriage": {"mass": 1.0}},
        "joints": {"belt": {"from": "motor", "to": "carriage", "ratio": 0.01}},
        "sensors": {"motor": {"body": "carriage", "column": "x"}, "carriage": {"body": "motor", "column": "phi"}},
    })  # fmt: skip
    assert [turns_at(machine, sensor) for sensor in machine.sensors.values()] == [False, True]


def test_node_that_is_not_an_element_has_no_body():
    assert body_of(MACHINE, "loop") == ""


def test_tape_span_has_linear_units():
    machine = Description.model_validate({
        "bodies": {"one": {"inertia": 1e-4, "radius": 0.02}, "two": {"inertia": 1e-4, "radius": 0.02}},
        "joints": {"tape": {"from": "one", "to": "two", "span": "open", "stiffness": 450.0}},
        "sensors": {"encoder": {"body": "one", "column": "x"}},
    })  # fmt: skip
    assert ends_turn(machine, "tape") == (False, False)


def test_texts_with_units_are_converted_to_si():
    entry = {"term": "friction.stribeck", "node": "motor", "F_s": "20 mNm", "v_s": "30 deg/s"}
    assert entry_in_si(MACHINE, entry) == pytest.approx({**entry, "F_s": 0.02, "v_s": 0.5235987756})
    given = {"term": "friction.quadratic", "node": "carriage", "Q": "2 N*s^2/m^2"}
    assert entry_in_si(MACHINE, given)["Q"] == 2.0


@pytest.mark.parametrize("value", [0.02, "0.02"])
def test_plain_numbers_are_read_as_si(value):
    entry = {"term": "friction.coulomb", "node": "motor", "F_C": value}
    assert entry_in_si(MACHINE, entry)["F_C"] == 0.02


def test_unit_of_another_dimension_is_refused():
    with pytest.raises(ValueError, match="F_C: '3 N' is not a quantity in Nm"):
        entry_in_si(MACHINE, {"term": "friction.coulomb", "node": "motor", "F_C": "3 N"})


def test_every_unit_is_known_to_the_converter():
    from rtctl.config.units import convert

    assert all(convert(1.0, unit, unit) == 1.0 for pair in DIMENSIONS.values() for unit in pair)
