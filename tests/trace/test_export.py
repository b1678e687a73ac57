"""Each export format is read back by a third-party reader."""

import csv
import json
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import loadmat
from trace_rows import CASE, COLUMNS, ROW, make

from rtctl.config.errors import UserError
from rtctl.trace.bundle import save_case
from rtctl.trace.export import FORMATS, Selection, export, mcap_file, source
from rtctl.trace.export.mat_file import names
from rtctl.trace.export.source import Source
from rtctl.trace.recorder import Recorder
from rtctl.trace.rotation import Rotation

ROWS = 700
BEGAN = "2026-11-21T10:44:28+00:00"
BEGAN_NS = 1795257868 * 10**9
UNITS = {"tick": "1", "t": "s", "ref": "rad", "u1": "V", "state": "1"}
NAMES = ["t", "tick", "ref", "u1", "state"]  # clock first


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    """700 rows at 500 Hz in two parts."""
    case = {**CASE, "recorded_at": BEGAN}
    run = Recorder(tmp_path_factory.mktemp("run") / "b", COLUMNS, ROW, case, rotation=Rotation(minutes=1 / 60))
    for first in range(0, ROWS, 77):
        run.put(make(first, min(77, ROWS - first)))
    return run.finish()


@pytest.fixture(autouse=True)
def small_batches(monkeypatch):
    monkeypatch.setattr(source, "ROW_GROUP", 90)
    monkeypatch.setattr(mcap_file, "ROWS", 40)


def same(columns, ticks=None):
    """Whether `columns` are the rows of `ticks` (default all), bit-exact."""
    truth = make(0, ROWS)[slice(None) if ticks is None else ticks]
    found = {name: np.asarray(columns[name]) for name in ROW.names}
    return all(np.array_equal(found[name], truth[name]) for name in ROW.names)


def test_export_to_csv(bundle, tmp_path):
    done = export(bundle, "csv", tmp_path / "a.csv")
    raw = done.path.read_bytes()
    assert raw.count(b"\r\n") == raw.count(b"\n") == ROWS + 1  # RFC 4180
    with done.path.open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["t [s]", "tick", "ref [rad]", "u1 [V]", "state"]
    columns = dict(zip(NAMES, np.array(rows, dtype=float).T, strict=True))
    assert same(columns)
    assert (done.rows, done.columns, done.bytes) == (ROWS, tuple(NAMES), len(raw))


def test_export_to_mat(bundle, tmp_path):
    found = loadmat(export(bundle, "mat", tmp_path / "a.mat").path, simplify_cells=True)
    assert same(found)
    assert found["t"].dtype == np.float64 and found["tick"].dtype == np.int64
    assert found["units"] == UNITS
    assert json.loads(found["case_json"])["plant"] == "ivu"


def test_mat_names_are_valid_in_matlab(tmp_path):
    columns = {
        "t": [0.0, 1.0],
        "position.d": [1.0, 2.0],
        "position_d": [3.0, 4.0],
        "1st": [5.0, 6.0],
        "units": [7.0, 8.0],
    }
    folder = written(tmp_path / "b", columns)
    given = names(Source(folder))
    assert list(given.values()) == ["t", "position_d", "position_d_2", "x1st", "units_2"]
    found = loadmat(export(folder, "mat").path, simplify_cells=True)
    assert all(np.array_equal(found[made], columns[name]) for name, made in given.items())
    assert found["columns"]["position_d_2"] == "position_d"


def test_export_to_parquet(bundle, tmp_path):
    table = pq.read_table(export(bundle, "parquet", tmp_path / "a.parquet").path)
    assert same(table)
    assert {f.name: f.metadata[b"unit"].decode() for f in table.schema} == UNITS
    assert json.loads(table.schema.metadata[b"case"])["sample_rate"] == 500.0


def test_duckdb_reads_exported_parquet(bundle, tmp_path):
    duckdb = pytest.importorskip("duckdb")
    path = export(bundle, "parquet", tmp_path / "a.parquet").path
    assert same(duckdb.sql(f"select * from '{path}'").fetchnumpy())


def test_export_to_mcap(bundle, tmp_path):
    """Read by mcap and decoded by protobuf; checksums and summary are checked."""
    decoder = pytest.importorskip("mcap_protobuf.decoder")
    from mcap.reader import make_reader

    with export(bundle, "mcap", tmp_path / "a.mcap").path.open("rb") as file:
        opened = make_reader(file, validate_crcs=True, decoder_factories=[decoder.DecoderFactory()])
        found = list(opened.iter_decoded_messages())
        summary = opened.get_summary()
        attached = {a.name: json.loads(a.data) for a in opened.iter_attachments()}
        told = {m.name: m.metadata for m in opened.iter_metadata()}
        some = [m for *_, m in opened.iter_messages()][500:503]
    schema, channel, message, _ = found[0]
    assert (channel.topic, channel.message_encoding, schema.encoding) == ("/ivu", "protobuf", "protobuf")
    assert (schema.name, message.sequence) == ("rtctl.ivu", 0) and [m.sequence for m in some] == [500, 501, 502]
    assert same({name: [getattr(row, name) for *_, row in found] for name in NAMES})
    assert all(m.log_time == m.publish_time for _, _, m, _ in found)
    assert [m.log_time - BEGAN_NS for _, _, m, _ in found] == [2_000_000 * k for k in range(ROWS)]
    assert attached["case.json"]["plant"] == "ivu" and told == {"rtctl.units": UNITS}
    counted = summary.statistics
    assert (counted.message_count, counted.channel_message_counts) == (ROWS, {1: ROWS})
    assert (counted.message_start_time, counted.message_end_time) == (BEGAN_NS, BEGAN_NS + 2_000_000 * (ROWS - 1))
    assert (counted.attachment_count, counted.metadata_count) == (1, 1)
    assert len(summary.chunk_indexes) == counted.chunk_count > 1


def test_export_to_mcap_of_many_columns_of_every_type(tmp_path):
    """Tags of two and three bytes, names invalid in protobuf, and gaps; read back by protobuf and by rtctl."""
    decoder = pytest.importorskip("mcap_protobuf.decoder")
    from mcap.reader import make_reader

    from rtctl.trace.imports import read

    columns = {"t": [0.0, 1.0], "position.d": [1.5, np.nan], "position_d": [3.5, 4.5], "1st": [5.0, 6.0]}
    kinds = (np.int8, np.int16, np.int32, np.int64, np.uint8, np.uint16, np.uint32, np.uint64, np.float32, np.bool_)
    for kind in kinds:
        most = 1 if kind is np.bool_ else np.finfo(kind).max if kind is np.float32 else np.iinfo(kind).max
        columns[kind.__name__] = np.array([0, most], kind)
    columns |= {f"c{n}": np.array([n, -n], float) for n in range(2100)}
    columns["some"] = pa.array([7, None], pa.int64())
    path = export(written(tmp_path / "b", columns), "mcap").path
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        *_, first, last = (row for *_, row in reader.iter_decoded_messages())
    assert (first.position_d, first.position_d_2, last.x1st, first.some) == (1.5, 3.5, 6.0, 7.0) and np.isnan(last.some)
    assert all(getattr(last, kind.__name__) == columns[kind.__name__][1] for kind in kinds)
    assert [getattr(last, f"c{n}") for n in range(2100)] == [-n for n in range(2100)]
    table = read(path)
    assert all(np.array_equal(table.columns[name], np.array(values, float), equal_nan=True)
               for name, values in columns.items() if name not in (k.__name__ for k in kinds))  # fmt: skip
    assert all(np.array_equal(table.columns[k.__name__], columns[k.__name__]) for k in kinds)


def test_export_to_mcap_json(bundle, tmp_path):
    reader = pytest.importorskip("mcap.reader")
    with export(bundle, "mcap-json", tmp_path / "a.mcap").path.open("rb") as file:
        opened = reader.make_reader(file)
        found = list(opened.iter_messages())
        attached = {a.name: json.loads(a.data) for a in opened.iter_attachments()}
    schema, channel, _ = found[0]
    assert (channel.topic, channel.message_encoding, schema.encoding) == ("/ivu", "json", "jsonschema")
    properties = json.loads(schema.data)["properties"]
    assert {name: p["unit"] for name, p in properties.items()} == UNITS
    assert {p["type"] for p in properties.values()} == {"number"}
    rows = [json.loads(message.data) for _, _, message in found]
    assert same({name: [row[name] for row in rows] for name in NAMES})
    assert all(message.log_time == message.publish_time for _, _, message in found)
    assert [m.log_time - BEGAN_NS for _, _, m in found] == [2_000_000 * k for k in range(ROWS)]
    assert attached["case.json"]["plant"] == "ivu"


def test_export_to_mf4(bundle, tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(export(bundle, "mf4", tmp_path / "a.mf4").path) as mdf:
        assert mdf.header.start_time.isoformat() == BEGAN
        signals = {name: mdf.get(name) for name in NAMES[1:]}
    assert same({"t": signals["ref"].timestamps, **{name: s.samples for name, s in signals.items()}})
    assert {name: s.unit for name, s in signals.items()} == {n: u for n, u in UNITS.items() if n != "t"}


def test_export_to_tdms(bundle, tmp_path):
    nptdms = pytest.importorskip("nptdms")
    found = nptdms.TdmsFile.read(export(bundle, "tdms", tmp_path / "a.tdms").path)
    group = found["ivu"]
    assert same({name: group[name][:] for name in NAMES})
    assert {name: group[name].properties["unit_string"] for name in NAMES} == UNITS
    ref = group["ref"]
    assert np.allclose(ref.time_track(), make(0, ROWS)["t"], rtol=0, atol=1e-12)
    assert str(ref.properties["wf_start_time"]).startswith("2026-11-21T10:44:28")


@pytest.mark.parametrize("to", FORMATS)
def test_export_of_every_third_row_of_a_time_range(bundle, tmp_path, to):
    pytest.importorskip(FORMATS[to].package or "numpy")
    done = export(bundle, to, tmp_path / "a", Selection(("u1",), 0.1, 0.9, 3))
    assert (done.rows, done.columns) == (134, ("t", "u1"))
    assert list(tmp_path.iterdir()) == [tmp_path / "a"]  # no temporary files are left


def test_exported_time_range_does_not_depend_on_the_batches(bundle, tmp_path):
    table = pq.read_table(export(bundle, "parquet", tmp_path / "a.parquet", Selection((), 0.1, 0.9, 3)).path)
    assert same(table, slice(50, 451, 3))


def test_missing_values_are_exported_as_empty(tmp_path):
    folder = written(
        tmp_path / "b", {"t": [0.0, 1.0, 2.0], "ref": [np.nan, 1.5, np.inf], "x": None, "on": [True, False, True]}
    )
    with export(folder, "csv").path.open(newline="") as file:
        assert list(csv.reader(file))[1:] == [["0", "", "", "1"], ["1", "1.5", "", "0"], ["2", "inf", "", "1"]]
    assert np.isnan(loadmat(export(folder, "mat").path)["x"]).all()
    pytest.importorskip("mcap")
    from mcap.reader import make_reader

    with export(folder, "mcap-json").path.open("rb") as file:
        rows = [json.loads(message.data) for _, _, message in make_reader(file).iter_messages()]
    assert rows == [{"t": 0.0, "on": True}, {"t": 1.0, "ref": 1.5, "on": False}, {"t": 2.0, "on": True}]


@pytest.mark.parametrize("to", ["mcap", "mcap-json"])
def test_clock_that_starts_below_zero_is_exported(tmp_path, to):
    pytest.importorskip("mcap")
    from mcap.reader import make_reader

    folder = written(tmp_path / "b", {"t": [-1.5, -0.5]})
    with export(folder, to).path.open("rb") as file:
        assert [m.log_time for _, _, m in make_reader(file).iter_messages()] == [500_000_000, 1_500_000_000]


@pytest.mark.parametrize(
    ("to", "selection", "words"),
    [
        ("csw", Selection(), "no format 'csw'; did you mean 'csv'"),
        ("hdf", Selection(), "there is csv, mat, parquet, mcap, mcap-json, rrd, mf4, tdms"),
        ("csv", Selection(("reff",)), "no column 'reff'; is it 'ref'"),
        ("csv", Selection((), 5.0, 6.0), r"holds no rows from 5 s to 6 s; its column t runs from 0 s to 1.398 s"),
    ],
)
def test_invalid_format_or_selection_is_refused(bundle, tmp_path, to, selection, words):
    with pytest.raises(UserError, match=words):
        export(bundle, to, tmp_path / "a", selection)
    assert not list(tmp_path.iterdir())


def test_invalid_bundle_or_target_is_refused(bundle, tmp_path):
    with pytest.raises(UserError, match="not a folder"):
        export(tmp_path / "nothing", "csv")
    with pytest.raises(UserError, match="cannot be written"):
        export(bundle, "csv", tmp_path / "nowhere" / "a.csv")
    folder = written(tmp_path / "b", {"t": [0.0, 1.0]})
    with pytest.raises(UserError, match="is the recording itself"):
        export(folder, "parquet", folder / "recording.parquet")
    with pytest.raises(UserError, match="is a part of the bundle"):
        export(folder, "csv", folder / "case.json")
    with pytest.raises(UserError, match="holds string"):
        export(written(tmp_path / "c", {"t": [0.0], "name": ["a"]}), "csv")


@pytest.mark.parametrize(
    ("to", "package", "how"),
    [
        ("mf4", "asammdf", r"'rtctl\[mf4\]'"),
        ("tdms", "nptdms", r"'rtctl\[tdms\]'"),
        ("mcap-json", "mcap", "'mcap'"),
        ("rrd", "rerun", r"'rtctl\[rerun\]'"),
    ],
)
def test_missing_package_error_names_the_extra(bundle, tmp_path, monkeypatch, to, package, how):
    for name in [*sys.modules, package]:
        if name.partition(".")[0] == package:
            monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, f"rtctl.trace.export.{FORMATS[to].module}", raising=False)
    with pytest.raises(UserError, match=rf"needs the package {package}: pip install {how}"):
        export(bundle, to, tmp_path / "a")


def test_failed_export_leaves_the_old_file(bundle, tmp_path, small_disk):
    path = tmp_path / "a.csv"
    path.write_text("before")
    with small_disk(2000), pytest.raises(UserError, match="File too large"):
        export(bundle, "csv", path)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.csv", "before")]


def written(folder, columns):
    """A bundle of these columns."""
    folder.mkdir()
    rows = len(columns["t"])
    table = pa.table({name: pa.nulls(rows) if values is None else values for name, values in columns.items()})
    pq.write_table(table, folder / "recording.parquet")
    save_case(folder, {"format": 1, "plant": "axis", "sample_rate": 1.0})
    return folder
