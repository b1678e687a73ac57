"""Refusal of contradictory descriptions: the message has the path and the correction."""

import copy
from typing import Any

import pytest
from pydantic import ValidationError

from rtctl.plants import linear
from rtctl.plants.graph.description import Description

BELT: dict[str, Any] = {
    "bodies": {"motor": {"inertia": 2e-5}, "slide": {"mass": 1.4}},
    "joints": {"belt": {"from": "motor", "to": "slide", "ratio": 0.0127, "stiffness": 8e4, "damping": 35.0}},
    "drives": {"servo": {"body": "motor", "gain": 0.03}},
    "sensors": {"encoder": {"body": "motor", "column": "counts", "counts_per_unit": 1273.24}},
}
TAPE: dict[str, Any] = {
    "bodies": {
        "reel": {"inertia": 1e-4, "radius": 0.03, "reel": {"core": 0.02, "thickness": 1e-4, "width": 1.0}},
        "capstan": {"inertia": 1e-5, "radius": 0.0125},
    },
    "joints": {"tape": {"from": "capstan", "to": "reel", "span": "open", "stiffness": 450.0}},
    "sensors": {"encoder": {"body": "capstan", "column": "counts"}},
}
REFUSED = {  # path -> (value, message)
    "joints.belt.to": ("slid", "joints.belt.to: there is no body 'slid'; did you mean 'slide'?"),
    "joints.belt.from": ("slide", "joints.belt.to: the joint connects slide to itself"),
    "joints.belt.stiffness": (-1.0, "greater than or equal to 0"),
    "joints.belt.ratio": (0.0, "ratio: 0 connects nothing"),
    "bodies.motor.inertia": (0.0, "greater than 0"),
    "bodies.motor": ({"dry": 1.0}, r"give inertia \(a body that turns\) or mass"),
    "bodies.slide.radius": (0.1, "radius: this body slides; give inertia"),
    "bodies.slide.gravity": ({"mass": 1.0, "arm": 0.1}, "gravity: this body slides; give incline"),
    "bodies.motor.gravity": ({"incline": 0.1}, "gravity: this body turns; give mass and arm"),
    "bodies.loop": ({"mass": 1.0}, "bodies.loop: 'loop' has a meaning of its own"),
    "bodies.2nd": ({"mass": 1.0}, "bodies.2nd: a name is a letter"),
    "bodies.lone": ({"mass": 1.0}, "bodies.lone: no sensor sees it"),
    "drives.servo.body": ("frame", "drives.servo.body: (there is no body 'frame'|frame is the frame)"),
    "drives.servo.gain": (0.0, "gain: 0 drives nothing"),
    "drives.servo.kind": ("current", "torque_constant is missing"),
    "drives.servo.zero": (1e-3, "zero: it is that of the low pass"),
    "drives.servo": ({"body": "motor", "kind": "voltage", "torque_constant": 0.1}, "resistance is missing"),
    "sensors.encoder.column": ("u", "sensors.encoder.column: 'u' is that of drives.servo already"),
    "sensors.encoder.measures": ("force", "measures: force is not seen at a body"),
    "symbols": ({"k": ["joints.belt.stifness"]}, r"symbols.k: .*did you mean 'joints.belt.stiffness'\?"),
}
REFUSED_TAPE = {
    "sensors.encoder.through": (
        "tap",
        "sensors.encoder.through: there is no span at capstan 'tap'; did you mean 'tape'?",
    ),
    "bodies.capstan.radius": (None, "joints.tape.from: capstan has no radius for the tape"),
    "bodies.reel.radius": (0.01, "bodies.reel.radius: 0.01 m is less than the core of 0.02 m"),
    "bodies.reel.reel.density": (
        1e5,
        "bodies.reel.inertia: 0.0001 kg m.2 is not more than the 0.102102 kg",
    ),
    "joints.tape.ratio": (2.0, "ratio: that of a span follows from the radii"),
    "joints.tape.stiffness": (None, "stiffness is missing; a span of tape needs it"),
    "joints.tape.span": (None, "bodies.reel.reel: no span of tape ends here"),
    "joints.gear": ({"from": "reel", "to": "capstan"}, "joints.gear.stiffness is missing: reel is a reel"),
}


def changed(data: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    """Copy of a description with another value at `path`; None deletes the key."""
    out = copy.deepcopy(data)
    *groups, key = path.split(".")
    at = out
    for group in groups:
        at = at[group]
    at[key] = value
    if value is None:
        del at[key]
    return out


def test_belt_and_tape_descriptions_are_valid():
    Description.model_validate(BELT)
    Description.model_validate(TAPE)


@pytest.mark.parametrize("path", REFUSED)
def test_invalid_belt_description_is_refused(path):
    value, words = REFUSED[path]
    with pytest.raises(ValidationError, match=words):
        Description.model_validate(changed(BELT, path, value))


@pytest.mark.parametrize("path", REFUSED_TAPE)
def test_invalid_tape_description_is_refused(path):
    value, words = REFUSED_TAPE[path]
    with pytest.raises(ValidationError, match=words):
        Description.model_validate(changed(TAPE, path, value))


def test_rigid_loop_and_rigid_joint_to_the_frame_are_refused():
    loop = changed(BELT, "joints.belt", {"from": "motor", "to": "slide", "ratio": 0.01})
    loop["joints"]["second"] = {"from": "motor", "to": "slide", "ratio": 0.02}
    with pytest.raises(ValidationError, match=r"joints.second.stiffness is missing: .* closes a loop of rigid joints"):
        Description.model_validate(loop)
    with pytest.raises(ValidationError, match="a rigid joint to the frame holds slide still"):
        Description.model_validate(changed(BELT, "joints.stop", {"from": "frame", "to": "slide"}))


def test_too_many_bodies_and_machines_without_a_moving_body_are_refused():
    more = {f"b{i}": {"mass": 1.0} for i in range(linear.MOST_BODIES + 1 - len(BELT["bodies"]))}
    many = changed(BELT, "bodies", {**BELT["bodies"], **more})
    with pytest.raises(ValidationError, match=f"bodies: 13 are described; {linear.MOST_BODIES} is the most"):
        Description.model_validate(many)
    still = changed(BELT, "bodies", {"motor": {"fixed": True}, "slide": {"fixed": True}})
    with pytest.raises(ValidationError, match="every body is fixed"):
        Description.model_validate(still)


def test_force_sensor_at_a_rigid_joint_is_refused():
    rigid = changed(BELT, "joints.belt", {"from": "motor", "to": "slide", "ratio": 0.01})
    rigid["sensors"]["force"] = {"joint": "belt", "measures": "force", "column": "pull"}
    with pytest.raises(ValidationError, match=r"sensors.force.joint: belt is rigid"):
        Description.model_validate(rigid)
