"""A belt axis with three effects in one compiled structure; each test sets its sizes."""

from typing import Any

import pytest

from rtctl.config.load import load_settings, set_paths
from rtctl.config.yaml_file import load_yaml
from rtctl.improve import played
from rtctl.machines import class_of

EFFECTS = (
    {"term": "drive.deadband", "node": "amplifier", "band": 0.0},
    {"term": "friction.coulomb", "node": "carriage", "F_C": 0.0},
    {"term": "load.spring", "node": "carriage", "k": 0.0},
)
SIZES = {"dead band": "plant.physics.0.band", "dry": "plant.physics.1.F_C", "spring": "plant.physics.2.k"}


def belt() -> Any:
    path = "configs/machines/belt.yaml"
    return played.with_reference(load_settings(path, class_of(load_yaml(path).data), []))


@pytest.fixture(scope="session")
def with_sizes():
    """Function (sizes of effects) -> config of the belt axis; effects without a given size have size 0."""
    base = set_paths(belt(), {"plant.physics": [dict(effect) for effect in EFFECTS]})
    return lambda **sizes: set_paths(base, {SIZES[name.replace("_", " ")]: value for name, value in sizes.items()})
