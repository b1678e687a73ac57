"""Benchmark axes without friction in the nominal model: equations, repeatability, scores."""

import json
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from rtctl.diagnose.record.format1 import load_record


@pytest.fixture(scope="module")
def axes(benchmark_module: Callable[[str], ModuleType]) -> ModuleType:
    return benchmark_module("bare_axes")


def test_drive_force_at_constant_speed_equals_both_frictions(axes):
    carriage = axes.Carriage(2.0, 5.0, 3.0, 3.0, 0.01, 3e5, 50.0, 0.0, 0.0)
    ref = 0.1 * axes.DT * np.arange(4000)  # m, at 0.1 m/s
    _, u = axes.moved(carriage, axes.Loop(15.0, 40.0, 3.0, 1e-7), ref, np.zeros(4000))
    assert 3.0 * np.mean(u[2000:]) == pytest.approx(3.0 + 5.0 * 0.1, rel=0.01)


def test_axis_case_is_a_repeatable_bundle(axes, tmp_path):
    assert axes.conceal(tmp_path / "a", 7, 1) == ("friction.stribeck",)
    axes.conceal(tmp_path / "b", 7, 1)
    one, two = (load_record(tmp_path / name) for name in "ab")
    np.testing.assert_array_equal(one.y["x"], two.y["x"])
    assert set(one.case.parameters) == {"M"}


def test_diagnoses_of_the_axes_are_scored(axes, tmp_path):
    hidden = {"a": (), "b": ("friction.stribeck",), "c": ("drive.offset",), "d": ("friction.stribeck",)}
    told = {"a": ("named", [*axes.PLAIN, axes.BRISTLES]), "b": ("named", [*axes.PLAIN]),
            "c": ("ambiguous", [*axes.PLAIN, "friction.asymmetry", "drive.offset"]), "d": ("unnamed", [])}  # fmt: skip
    for case, (verdict, names) in told.items():
        (tmp_path / case).mkdir()
        entry = {"verdict": verdict, "effects": [{"name": name} for name in names]}
        (tmp_path / case / "diagnosis.json").write_text(json.dumps(entry))
    found = axes.judged(hidden, tmp_path)
    assert (found["right"], found["ambiguous_with_it"], set(found["others"])) == (1, 1, {"b", "d"})
