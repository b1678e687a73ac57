"""Units of a description depend on the kind of the element."""

import copy

import pytest
from pydantic import ValidationError

from rtctl.plants.graph.description import Description
from rtctl.plants.graph.units import drive_units, joint_units, measured_unit

TAPE = {
    "bodies": {
        "reel": {"inertia": "1.2 kg*cm^2", "radius": "30 mm", "dry": "2 mNm",
                 "reel": {"core": "2 cm", "thickness": "0.1 mm", "density": "1.7 g/cm^3", "width": "37 mm"}},
        "capstan": {"inertia": "0.1 kg*cm^2", "radius": "12.5 mm"},
        "table": {"mass": "900 g", "dry": "3 N", "viscous": "0.5 N*s/m", "gravity": {"incline": "90 deg"}},
    },
    "joints": {
        "tape": {"from": "capstan", "to": "reel", "span": "crossed", "stiffness": "0.45 N/mm", "damping": "12 N*s/m"},
        "screw": {"from": "reel", "to": "table", "ratio": "5 mm/turn", "stiffness": "60 N/um"},
    },
    "drives": {"motor": {"body": "reel", "kind": "current", "gain": "200 mA/V", "torque_constant": "61 mNm/A",
                         "bandwidth_hz": "1 kHz", "zero": "0.1 ms"}},
    "sensors": {"encoder": {"body": "capstan", "column": "c", "counts_per_unit": "10000 counts/turn"}},
}  # fmt: skip


def test_quantities_are_converted_to_si_numbers():
    machine = Description.model_validate(TAPE)
    values = dict(machine.paths())
    wanted = {
        "bodies.reel.inertia": 1.2e-4, "bodies.reel.radius": 0.03, "bodies.reel.dry": 2e-3,
        "bodies.reel.reel.core": 0.02, "bodies.reel.reel.thickness": 1e-4, "bodies.reel.reel.density": 1700.0,
        "bodies.reel.reel.width": 0.037, "bodies.table.mass": 0.9, "bodies.table.gravity.incline": 1.5707963,
        "joints.tape.stiffness": 450.0, "joints.tape.damping": 12.0, "joints.screw.ratio": 0.005 / 6.2831853,
        "joints.screw.stiffness": 6e7, "drives.motor.gain": 0.2, "drives.motor.torque_constant": 0.061,
        "drives.motor.bandwidth_hz": 1000.0, "drives.motor.zero": 1e-4, "sensors.encoder.counts_per_unit": 1591.5494,
    }  # fmt: skip
    assert {path: values[path] for path in wanted} == pytest.approx(wanted, rel=1e-7)


@pytest.mark.parametrize(
    ("group", "name", "key", "value"),
    [
        ("bodies", "table", "dry", "3 Nm"), ("bodies", "capstan", "radius", "12 rad"),
        ("joints", "screw", "ratio", "5 N"), ("joints", "tape", "stiffness", "4 Nm/rad"),
        ("drives", "motor", "zero", "3 V"),
    ],
)  # fmt: skip
def test_unit_of_another_dimension_is_refused_with_its_path(group, name, key, value):
    data = copy.deepcopy(TAPE)
    data[group][name][key] = value
    with pytest.raises(ValidationError, match=rf"{group}\.{name}\.{key}: "):
        Description.model_validate(data)


def test_units_of_joints_drives_and_sensors():
    assert joint_units(True, False) == {"ratio": "m/rad", "stiffness": "N/m", "damping": "N*s/m"}
    assert joint_units(True, True) == {"ratio": "", "stiffness": "Nm/rad", "damping": "Nm*s/rad"}
    assert drive_units("force", "%", True)["gain"] == "Nm/percent"
    assert drive_units("voltage", "V", False)["torque_constant"] == "N/A"
    assert (measured_unit("speed", True), measured_unit("force", False)) == ("rad/s", "N")


@pytest.mark.parametrize(("per_unit", "step"), [(1, "2 mm"), (-1, "2 mm"), (1000.0, 2.0)])
def test_resolution_is_converted_to_si(per_unit, step):
    data = copy.deepcopy(TAPE)
    data["sensors"]["scale"] = {"body": "table", "column": "s", "per_unit": per_unit, "resolution": step}
    sensor = Description.model_validate(data).sensors["scale"]
    assert sensor.grain / abs(sensor.scale) == pytest.approx(2e-3)


@pytest.mark.parametrize("change", [{"measures": "speed", "counts_per_unit": 100.0}, {"counts_per_unit": None}])
def test_only_an_edge_counter_may_have_no_direction(change):
    data = copy.deepcopy(TAPE)
    data["sensors"]["encoder"] |= {"direction": False, **change}
    with pytest.raises(ValidationError, match="direction: false is for a counter of edges"):
        Description.model_validate(data)
