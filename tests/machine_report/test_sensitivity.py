"""Identifiability by sensors: known null directions are found, and a force sensor resolves them."""

import fused
import numpy as np
import pytest

from rtctl.machine_report import sensitivity
from rtctl.machine_report.sensitivity import judged


def config(name, **changes):
    return fused.config(f"machines/{name}", **changes)


def test_common_scale_of_all_forces_is_unidentifiable_without_a_force_sensor():
    found = sensitivity.sensitivity(config("axis"))
    (group,) = found.groups
    assert set(group.names) == {
        "bodies.carriage.mass", "bodies.carriage.dry", "bodies.carriage.viscous", "drives.drive.gain",
    }  # fmt: skip
    assert group.changes == pytest.approx([1.0] * 4, abs=0.05)
    assert found.rank == 3 and not found.unseen
    assert any("larger by one factor" in line for line in sensitivity.sentences(found))


def test_force_sensor_identifies_the_common_scale():
    sensor = {"joint": "belt", "measures": "force", "column": "pull", "resolution": "0.1 N"}
    blind, seeing = (
        sensitivity.sensitivity(config("belt", **change)) for change in ({}, {"machine__sensors__cell": sensor})
    )
    assert (blind.rank, seeing.rank) == (8, 9)
    assert "joints.belt.stiffness" in seeing.told


def test_factors_of_a_product_form_one_group():
    found = sensitivity.sensitivity(config("pendulum"))
    assert ("bodies.rod.gravity.mass", "bodies.rod.gravity.arm") in [group.names for group in found.groups]


def test_parameter_without_effect_is_unidentifiable():
    J = np.zeros((50, 3))
    J[:, 0], J[:, 1] = 100.0, np.linspace(-100, 100, 50)
    found = judged(["a.a", "a.b", "a.c"], J)
    assert found.unseen == ("a.c",) and found.rank == 2 and set(found.told) == {"a.a", "a.b"}
    assert found.told["a.a"] == pytest.approx(1 / np.sqrt((J[:, 0] ** 2).sum()))
