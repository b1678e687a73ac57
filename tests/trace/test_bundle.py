import json
import tracemalloc

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from trace_rows import CASE, COLUMNS, ROW, is_truth, make

from rtctl.config.errors import UserError
from rtctl.trace import bundle
from rtctl.trace.bundle import load_bundle, save_case, write_parquet
from rtctl.trace.columns import record_batch, schema

SCHEMA = schema(COLUMNS, ROW)


def batches(rows: int, size: int = 1000):
    return (record_batch(make(first, min(size, rows - first)), SCHEMA) for first in range(0, rows, size))


@pytest.fixture
def folder(tmp_path):
    write_parquet(tmp_path, batches(2500), SCHEMA)
    save_case(tmp_path, CASE)
    return tmp_path


def test_bundle_is_read_back_with_units(folder):
    found = load_bundle(str(folder))
    assert is_truth(found.columns, range(2500))
    assert found.columns["state"].dtype == np.int32
    assert (found.case, found.folder) == (CASE, folder)
    assert found.units["u1"] == "V"


def test_parquet_is_zstd_in_row_groups_with_units(tmp_path, monkeypatch):
    monkeypatch.setattr(bundle, "ROW_GROUP", 4000)
    assert write_parquet(tmp_path, batches(10_500), SCHEMA) == 10_500
    file = pq.ParquetFile(tmp_path / "recording.parquet")
    assert [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)] == [4000, 4000, 2500]
    assert file.metadata.row_group(0).column(0).compression == "ZSTD"
    assert file.schema_arrow.field("t").metadata[b"unit"] == b"s"


def test_memory_does_not_grow_with_the_length_of_the_recording(tmp_path, monkeypatch):
    monkeypatch.setattr(bundle, "ROW_GROUP", 2000)

    def most(rows):
        tracemalloc.start()
        peak, held = 0, pa.total_allocated_bytes()

        def watched():
            nonlocal peak
            for batch in batches(rows):
                peak = max(peak, pa.total_allocated_bytes() - held + tracemalloc.get_traced_memory()[0])
                yield batch

        write_parquet(tmp_path, watched(), SCHEMA)
        tracemalloc.stop()
        return peak

    most(4000)
    assert most(200_000) < 2 * most(20_000)


def test_shorter_parquet_never_replaces_the_old_one(tmp_path):
    with pytest.raises(OSError, match="would hold 100 rows where 101 were recorded"):
        write_parquet(tmp_path, batches(100), SCHEMA, expect=101)
    assert list(tmp_path.iterdir()) == []


def test_full_disk_leaves_the_old_parquet(folder, small_disk):
    with small_disk(2000), pytest.raises(OSError):
        write_parquet(folder, batches(50_000), SCHEMA)
    assert is_truth(load_bundle(folder).columns, range(2500))
    assert sorted(p.name for p in folder.iterdir()) == ["case.json", "recording.parquet"]


def test_unwritable_case_leaves_the_old_case(folder, small_disk):
    with small_disk(10), pytest.raises(OSError):
        save_case(folder, {**CASE, "notes": "x" * 1000})
    with pytest.raises(ValueError):
        save_case(folder, {"x": float("nan")})
    with pytest.raises(TypeError, match="cannot hold a set"):
        save_case(folder, {"x": {1}})
    assert load_bundle(folder).case == CASE
    assert sorted(p.name for p in folder.iterdir()) == ["case.json", "recording.parquet"]


def test_case_may_hold_numpy_values(tmp_path):
    save_case(tmp_path, {"a": np.float64(1.5), "b": np.arange(3), "c": np.bool_(True), "d": tmp_path})
    assert json.loads((tmp_path / "case.json").read_text()) == {
        "a": 1.5,
        "b": [0, 1, 2],
        "c": True,
        "d": str(tmp_path),
    }


def drop(name):
    return lambda folder: (folder / name).unlink()


def put(name, text):
    return lambda folder: (folder / name).write_bytes(text)


def table(**columns):
    return lambda folder: pq.write_table(pa.table(columns), folder / "recording.parquet")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (drop("case.json"), "case.json is missing"),
        (drop("recording.parquet"), "recording.parquet is missing"),
        (put("recording.parquet", b"PAR1 no"), "recording.parquet cannot be read as Parquet"),
        (put("recording.parquet", b""), "recording.parquet cannot be read as Parquet"),
        (put("case.json", b'{"format": 1,\n "pla'), "case.json, line 2: not JSON"),
        (put("case.json", b"\xff\xfe"), "not text in UTF-8"),
        (put("case.json", b"[1]"), "holds a list"),
        (put("case.json", b"[" * 100_000), "nested too deeply|not JSON"),
        (put("case.json", b'{"format": 3}'), "format is 3; this program reads formats 1 and 2"),
        (table(time=[1.0], ref=[0.0]), "no column 't'.*is it 'time'"),
        (table(t=pa.array([], pa.float64())), "holds no rows"),
        (table(t=[0.0, None]), "'t' has 1 empty cells"),
        (table(t=[0.0, float("nan")]), "'t' is not finite in row 1"),
        (table(t=[0.0], note=["hello"]), "'note' holds string"),
    ],
)
def test_damaged_bundle_gives_an_error_message(folder, spoil, words):
    spoil(folder)
    with pytest.raises(UserError, match=words):
        load_bundle(folder)


def test_unfinished_recording_error_names_repair(tmp_path):
    (tmp_path / "recording.arrows").touch()
    with pytest.raises(UserError, match="run: rtctl trace repair"):
        load_bundle(tmp_path)
    with pytest.raises(UserError, match="is not a folder"):
        load_bundle(tmp_path / "nowhere")
