"""Counter wrap: unwrapped by counts per turn or by a power of two, otherwise reported."""

import numpy as np
import pytest

from rtctl.trace.bundle import load_bundle
from rtctl.trace.imports.counters import unwrapped
from rtctl.trace.imports.make import make_bundle
from rtctl.trace.imports.plan import Plan
from rtctl.trace.imports.table import Table

K = np.arange(2000)
TRUE = {
    "steady": 7.0 * K,
    "fast": 300.0 * K,
    "there and back": np.round(3000 * np.sin(K / 150.0)),
    "down": -3.0 * K + 5,
}


def wrapped(values, modulus, lowest=0):
    return (values - lowest) % modulus + lowest


@pytest.mark.parametrize("name", TRUE)
@pytest.mark.parametrize(
    ("modulus", "lowest", "told"),
    [(1000, 0, [1000.0]), (2048, 0, []), (65536, -32768, []), (65536, 0, []), (4096, 0, [2000.0]), (2**32, 0, [])],
)
def test_counter_wrap_is_removed_and_noted(name, modulus, lowest, told):
    counts = TRUE[name] + (modulus + lowest - 100 if modulus > 5000 else 0)
    seen = wrapped(counts, modulus, lowest)
    found = unwrapped("x_counts", seen, told)
    if np.array_equal(seen, counts):
        assert found.note == ""
        return
    assert np.array_equal(np.diff(found.counts), np.diff(counts))
    assert found.note.startswith(f"x_counts wraps at {modulus} counts: ")


def test_unknown_modulus_is_noted_and_the_counts_are_kept():
    seen = wrapped(TRUE["steady"], 1000)
    found = unwrapped("x_counts", seen)
    assert found.counts is seen
    assert "x_counts jumps by 993 counts at row 143" in found.note and "it wraps at 1000 to 1007 counts" in found.note


@pytest.mark.parametrize(
    "values",
    [
        TRUE["there and back"], np.where(K % 100 < 50, 0.0, 200.0), np.round(5 * np.sin(K / 10)), K * 0.0,
        np.cumsum(np.random.default_rng(3).integers(-50, 50, 2000)).astype(float),
    ],
)  # fmt: skip
def test_counter_without_a_wrap_is_unchanged(values):
    found = unwrapped("x_counts", values)
    assert found.counts is values and found.note == ""


def test_import_unwraps_by_the_counts_per_turn_of_the_case(tmp_path):
    angle = 7 * K
    columns = {"t": K / 500, "u1": np.sin(K / 9.0), "u2": np.cos(K / 9.0), "ref": 0.0 * K,
               "capstan_counts": angle % 2000, "reel1_counts": angle, "reel2_counts": angle}  # fmt: skip
    case = {
        "sensors": {"capstan_counts_per_rev": 2000, "reel_counts_per_rev": 500},
        "drive": {"amp_per_volt": [0.2, 0.2]},
    }
    made = make_bundle(Table(tmp_path / "a.csv", columns, {}), Plan(plant="ivu", case=case), tmp_path / "b")
    assert any("capstan_counts wraps at 2000 counts: 6 wraps are taken out" in note for note in made.notes)
    assert np.array_equal(load_bundle(tmp_path / "b").columns["capstan_counts"], angle)
