import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace.bundle import Bundle, save_case
from rtctl.trace.compare import as_dict, compare

N, RATE = 2000, 1000.0


def columns(start=500, gain=1.0, first=0, n=N):
    """Columns of a step at tick `start` and a lagged response, recorded from tick `first` on."""
    tick = np.arange(first, first + n)
    ref = np.where(tick < start, 0.0, 0.01)
    x = gain * 0.01 * -np.expm1(-np.maximum(tick - start, 0) / 50)
    return {"tick": tick, "t": tick / RATE, "target": ref, "x": x, "u": 100 * (ref - x)}


def bundle(folder, values, **case):
    folder.mkdir()
    table = pa.table(values)
    units = {"t": "s", "target": "m", "x": "m", "u": "V"}
    fields = [field.with_metadata({"unit": units.get(field.name, "")}) for field in table.schema]
    pq.write_table(table.cast(pa.schema(fields)), folder / "recording.parquet")
    save_case(folder, {"format": 1, "plant": "axis", "sample_rate": RATE, "parameters": {}, **case})
    return folder


def by_name(found):
    return {signal.column: signal for signal in found.signals}


def test_identical_recordings_have_no_difference(tmp_path):
    found = compare(bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", columns()))
    assert found.same and not found.different and (found.aligned, found.offset, len(found.rows_a)) == ("tick", 0, N)
    assert all((s.rms, s.largest, s.first_tick) == (0.0, 0.0, -1) for s in found.signals)


def test_difference_has_its_first_tick_and_largest_value(tmp_path):
    other = columns()
    other["u"] = other["u"].copy()
    other["u"][700] += 3.0
    other["u"][900] -= 4.0
    found = compare(bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", other))
    (signal,) = found.different
    assert (signal.column, signal.unit, signal.ticks) == ("u", "V", 2)
    assert (signal.first_tick, signal.first_t, signal.largest_tick) == (700, 0.7, 900)
    assert signal.largest == pytest.approx(4.0) and signal.rms == pytest.approx(5.0 / np.sqrt(N))
    assert not found.same
    assert compare(found.a, found.b, ["x", "t"]).same


def test_difference_of_one_bit_is_found(tmp_path):
    other = columns()
    other["x"] = other["x"].copy()
    other["x"][3] = -other["x"][3]  # negative zero
    found = compare(bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", other))
    assert [(s.column, s.first_tick, s.largest) for s in found.different] == [("x", 3, 0.0)]


def test_step_metrics_of_both_recordings_are_compared(tmp_path):
    found = compare(bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", columns(gain=0.9)))
    assert [len(found.steps_a), len(found.steps_b)] == [1, 1]
    assert found.steps_a[0]["final_error_mm"] == pytest.approx(0.0, abs=1e-6)
    assert found.steps_b[0]["final_error_mm"] == pytest.approx(1.0, rel=1e-6)
    json.dumps(as_dict(found))


def test_recordings_are_aligned_at_the_start_of_the_reference(tmp_path):
    a, b = bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", columns(start=800))
    found = compare(a, b)
    assert (found.aligned, found.offset, len(found.rows_a)) == ("reference", 300, N - 300)
    assert not found.different and "t" not in by_name(found)
    assert not found.same  # aligned, but not identical
    by_tick = compare(a, b, align="tick")
    assert by_name(by_tick)["target"].first_tick == 500 and by_name(by_tick)["target"].ticks == 300


@settings(deadline=None, max_examples=25)
@given(
    starts=st.tuples(st.integers(1, 900), st.integers(1, 900)),
    firsts=st.tuples(st.integers(0, 300), st.integers(0, 300)),
)
def test_any_time_shift_is_found(starts, firsts):
    a, b = (
        Bundle(columns(first + start, first=first), {"plant": "axis"}, "x", {})
        for start, first in zip(starts, firsts, strict=True)
    )
    found = compare(a, b)
    assert found.offset == starts[1] + firsts[1] - starts[0] - firsts[0]
    assert not [s for s in found.different if s.column not in ("tick", "t")]


def test_part_of_a_run_is_aligned_by_its_ticks(tmp_path):
    two = columns()
    two["target"] = two["target"] + np.where(two["tick"] < 1500, 0.0, 0.01)
    cut = {name: values[1000:] for name, values in two.items()}  # first change of its reference: tick 1500
    found = compare(bundle(tmp_path / "a", two), bundle(tmp_path / "b", cut))
    assert (found.aligned, found.offset, len(found.rows_a)) == ("tick", 0, 1000) and not found.different


def test_lost_rows_of_one_recording_are_skipped(tmp_path):
    kept = np.delete(np.arange(N), slice(100, 200))
    other = {name: values[kept] for name, values in columns().items()}
    found = compare(bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", other))
    assert len(found.rows_a) == N - 100 and not found.different and not found.same


def test_recordings_without_ticks_are_aligned_by_row(tmp_path):
    bare = {name: values for name, values in columns().items() if name != "tick"}
    found = compare(bundle(tmp_path / "a", bare), bundle(tmp_path / "b", bare))
    assert found.same and len(found.rows_a) == N


def test_columns_of_one_recording_and_missing_values_are_reported(tmp_path):
    one = {**columns(), "w": np.full(N, np.nan), "only": np.zeros(N)}
    two = {**columns(), "w": np.full(N, np.nan), "mine": np.zeros(N)}
    found = compare(bundle(tmp_path / "a", one), bundle(tmp_path / "b", two))
    assert (found.only_a, found.only_b) == (("only",), ("mine",)) and not found.same
    assert by_name(found)["w"].ticks == 0 and np.isnan(by_name(found)["w"].rms)


@pytest.mark.parametrize(
    ("change", "case", "asked", "error", "words"),
    [
        ({}, {"plant": "ldu"}, {}, UserError, "a is of machine axis and .*b of ldu"),
        ({}, {"sample_rate": 500.0}, {}, UserError, "a is of rate 1000.0 Hz and .*b of 500.0 Hz"),
        ({}, {}, {"columns": ["xx"]}, UserError, "a/recording.parquet has no column 'xx'; is it 'x'"),
        ({"target": np.zeros(N)}, {}, {"align": "reference"}, NoAnswer, "b: its reference never moves"),
        ({"tick": np.arange(N) + 10_000}, {}, {"align": "tick"}, NoAnswer, "no tick in common"),
    ],
)
def test_incomparable_recordings_are_refused(tmp_path, change, case, asked, error, words):
    a, b = bundle(tmp_path / "a", columns()), bundle(tmp_path / "b", {**columns(), **change}, **case)
    with pytest.raises(error, match=words):
        compare(a, b, **asked)


def test_constant_reference_aligns_by_ticks(tmp_path):
    still = {**columns(), "target": np.zeros(N)}
    assert compare(bundle(tmp_path / "a", still), bundle(tmp_path / "b", still)).aligned == "tick"
