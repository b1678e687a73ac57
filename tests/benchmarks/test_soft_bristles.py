"""Benchmark springs with hysteresis: loops, repeatability, scores."""

import json
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from rtctl.diagnose.record.format1 import load_record


@pytest.fixture(scope="module")
def springs(benchmark_module: Callable[[str], ModuleType]) -> ModuleType:
    return benchmark_module("soft_bristles")


def test_bristle_force_reaches_its_limit_in_both_directions(springs):
    F, k = 3.0, 1000.0
    t = np.arange(3000 * springs.FINE) / springs.RATE / springs.FINE
    u = 20.0 * np.sin(2 * np.pi * 0.5 * t)
    x = springs.moved(0.1, 5.0, k, F, 2e-4, springs.Kind(1.0, 0.1), u)
    held = u[:: springs.FINE] - k * x
    half = len(x) // 2
    moving = np.abs(np.gradient(x)) > 0.8 * np.abs(np.gradient(x)).max()
    late = moving & (np.arange(len(x)) > half)
    rub = 5.0 * np.gradient(x) * springs.RATE
    np.testing.assert_allclose((held - rub)[late], F * np.sign(np.gradient(x)[late]), atol=0.02 * F)


def test_spring_without_bristles_is_the_nominal_one(springs):
    x = springs.moved(1.0, 20.0, 100.0, 0.0, 1.0, springs.NONE, np.full(6000 * springs.FINE, 5.0))
    assert x[-1] == pytest.approx(0.05, rel=1e-3)


def test_spring_case_is_a_repeatable_bundle(springs, tmp_path):
    assert springs.conceal(tmp_path / "a", 7, 2) == springs.KINDS[2]
    springs.conceal(tmp_path / "b", 7, 2)
    one, two = (load_record(tmp_path / name) for name in "ab")
    np.testing.assert_array_equal(one.y["x"], two.y["x"])
    assert set(one.case.parameters) == {"M", "F_v", "k"}


def test_diagnoses_of_the_springs_are_scored(springs, tmp_path):
    none, slides, never = springs.KINDS[0], springs.KINDS[2], springs.KINDS[7]
    both = sorted(springs.LAW)
    told = {"a": (none, "nothing", []), "b": (slides, "named", both), "c": (never, "unnamed", []),
            "d": (never, "named", [*both, "structure.stiffening"]), "e": (slides, "unnamed", []),
            "f": (none, "named", both), "g": (never, "named", both)}  # fmt: skip
    for case, (_, verdict, names) in told.items():
        (tmp_path / case).mkdir()
        entry = {"verdict": verdict, "effects": [{"name": name} for name in names]}
        (tmp_path / case / "diagnosis.json").write_text(json.dumps(entry))
    found = springs.judged({case: kind for case, (kind, *_) in told.items()}, tmp_path)
    assert (found["right"], found["with_another"], set(found["others"])) == (3, 1, {"e", "f", "g"})
