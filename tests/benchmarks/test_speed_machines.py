"""Benchmark drives with a speed sensor: equations, repeatability, scores."""

import json
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from rtctl.diagnose.record.format1 import load_record


@pytest.fixture(scope="module")
def machines(benchmark_module: Callable[[str], ModuleType]) -> ModuleType:
    return benchmark_module("speed_machines")


def test_nominal_drive_reaches_its_speed(machines):
    drive = machines.Drive(2.0, 4.0, 6.0)
    t = np.arange(200) / 100.0
    v = machines.speed_of(drive, np.ones(200), 0.01, 200)
    np.testing.assert_allclose(v, 1.5 * (1.0 - np.exp(-2.0 * t)), atol=1e-4)
    late = machines.speed_of(drive._replace(delay=0.1), np.ones(200), 0.01, 200)
    np.testing.assert_allclose(late[10:], v[:-10], atol=1e-12)


def test_each_effect_changes_the_measured_speed(machines):
    rng = np.random.default_rng(0)
    u = machines.volts(rng, np.arange(1000) / 100.0) * np.linspace(0.5, 1.0, 1000)
    plain = machines.Drive(2.0, 4.0, 6.0)
    v = machines.speed_of(plain, u, 0.01, 200)
    for name in set(machines.NAMES) - {"blind"}:
        given = machines.drawn(np.random.default_rng(1), (name,), u, 100.0)._replace(M=2.0, F=4.0, K=6.0)
        assert np.std(machines.speed_of(given, u, 0.01, 200) - v) > 0.01 * np.std(v), name


def test_drive_case_is_a_repeatable_bundle(machines, tmp_path):
    number = machines.KINDS.index(("blind", "rings"))
    true = machines.conceal(tmp_path / "a", 7, number)
    assert true == ("sensor.rectified", "structure.resonance")
    machines.conceal(tmp_path / "b", 7, number)
    records = [load_record(tmp_path / name) for name in "ab"]
    np.testing.assert_array_equal(records[0].y["speed"], records[1].y["speed"])
    assert records[0].y["speed"].min() > -0.1 * records[0].y["speed"].max()
    assert "sensor" not in (tmp_path / "a" / "case.json").read_text().replace('"sensors"', "")


def test_diagnoses_of_the_drives_are_scored(machines, tmp_path):
    hidden = {"a": ("drive.lag",), "b": (), "c": ("drive.lag",), "d": ("drive.lag",), "e": ()}
    told = {"a": ("named", ["drive.lag"]), "b": ("nothing", []), "c": ("ambiguous", ["timing.delay", "drive.lag"]),
            "d": ("named", ["timing.delay"]), "e": ("unnamed", [])}  # fmt: skip
    fit = {"heldout_nrmse_before": 1.0, "heldout_nrmse_after": 0.2, "noise_floor": 0.0}
    for case, (verdict, names) in told.items():
        (tmp_path / case).mkdir()
        entry = {"verdict": verdict, "effects": [{"name": name} for name in names], "fit": fit}
        (tmp_path / case / "diagnosis.json").write_text(json.dumps(entry))
    found = machines.judged(hidden, tmp_path)
    assert (found["right"], found["ambiguous_with_it"], found["false_alarms"], found["nothing_missing"]) == (2, 1, 1, 2)
    assert (found["names_given"], found["names_right"], set(found["others"])) == (2, 1, {"d", "e"})
    assert found["gap_closed_median"] == pytest.approx(0.8)
