import json
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from rtctl.config.errors import UserError
from rtctl.diagnose.record.format1 import load_record
from rtctl.trace.bundle import load_bundle, save_case
from rtctl.trace.compare import compare
from rtctl.trace.export import export
from rtctl.trace.imports import read
from rtctl.trace.imports.make import known_columns, make_bundle
from rtctl.trace.imports.plan import Plan, load_plan, with_options

EMPS = Path(__file__).parents[3] / "shared" / "data" / "emps"
N = 2500
T = np.arange(N) * 0.001
X = 0.1 * np.sin(3 * T)  # m
U = np.cos(3 * T)  # V
MAP = {"t": "time", "u": "vir", "x": "qm"}


def plan(**given):
    return Plan.model_validate({"plant": "axis", "columns": MAP, "parameters": {"M": 95}, **given})


def text(path, header="time,vir,qm", rows=None, end="\n"):
    lines = [header] + ([f"{t!r},{u!r},{x!r}" for t, u, x in zip(T.tolist(), U.tolist(), X.tolist(), strict=True)]
                        if rows is None else rows)  # fmt: skip
    path.write_text(end.join(lines) + end)
    return path


def foreign(path):
    """One recording in each format, with column names of another laboratory."""
    columns = {"time": T, "vir": U, "qm": X}
    if path.suffix == ".csv":
        return text(path)
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".parquet":
        pq.write_table(pa.table(columns), path)
    elif path.suffix == ".mat":
        savemat(path, columns)
    else:
        from mcap.writer import Writer

        with path.open("wb") as file:
            writer = Writer(file)
            writer.start()
            channel = writer.register_channel("/log", "json", writer.register_schema("log", "jsonschema", b"{}"))
            for k in range(N):
                row = {name: values[k].item() for name, values in columns.items()}
                writer.add_message(channel, 10**18 + k * 10**6, json.dumps(row).encode(), 10**18 + k * 10**6)
            writer.finish()
    return path


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".parquet", ".mat", ".mcap"])
def test_import_of_each_format_is_bit_exact(tmp_path, suffix):
    if suffix == ".mcap":
        pytest.importorskip("mcap")
    made = make_bundle(read(foreign(tmp_path / f"a{suffix}")), plan(), tmp_path / "b")
    found = load_bundle(tmp_path / "b")
    assert all(np.array_equal(found.columns[name], values) for name, values in {"t": T, "u": U, "x": X}.items())
    assert found.units == {"t": "s", "u": "V", "x": "m", "w": "V"} and not found.columns["w"].any()
    assert (made.rows, made.rate, found.case["sample_rate"]) == (N, 1000.0, 1000.0)
    record = load_record(tmp_path / "b")
    assert record.case.parameters == {"M": 95.0} and not record.closed_loop


@pytest.mark.skipif(not EMPS.is_dir(), reason="the recording of a real axis is not here")
@pytest.mark.parametrize("to", ["csv", "mat", "parquet", "mcap"])
def test_real_axis_survives_export_and_import(tmp_path, to):
    if to == "mcap":
        pytest.importorskip("mcap")
    path = export(EMPS, to, tmp_path / f"emps.{to}").path
    case = {"drive": {"newton_per_volt": 35.150651, "limit_volt": 10.0}}
    make_bundle(read(path), Plan(plant="axis", parameters={"M": "95 kg"}, case=case), tmp_path / "b")
    assert not compare(EMPS, tmp_path / "b").different
    record = load_record(tmp_path / "b")
    assert (record.dt, len(record.t), record.case.drive.newton_per_volt) == (0.001, 24841, 35.150651)


@pytest.mark.parametrize("plant", ["axis", "ivu", "ldu"])
def test_columns_of_each_machine_survive_export_and_import(tmp_path, plant):
    known = known_columns(plant)
    values = {name: np.round(np.sin(np.arange(20.0) + k) * 100) for k, name in enumerate(known)}
    values["t"] = np.arange(20) * 0.01
    fields = [pa.field(c.name, pa.float64(), metadata={"unit": c.unit}) for c in known.values()]
    (tmp_path / "a").mkdir()
    pq.write_table(pa.table(values, schema=pa.schema(fields)), tmp_path / "a" / "recording.parquet")
    save_case(tmp_path / "a", {"format": 1, "plant": plant, "sample_rate": 100.0})
    gains = {"ivu": [0.2, 0.2], "ldu": [0.1], "axis": []}[plant]
    case = {"drive": {"amp_per_volt": gains}, "delay_samples": 1.0}
    path = export(tmp_path / "a", "csv", tmp_path / "a.csv").path
    make_bundle(read(path), Plan(plant=plant, case=case), tmp_path / "b")
    found = compare(tmp_path / "a", tmp_path / "b")
    assert len(found.signals) == len(known) and not found.different and not found.only_a and not found.only_b
    assert load_bundle(tmp_path / "b").units == {name: c.unit for name, c in known.items() if c.unit}


def test_units_of_the_file_and_of_the_user_are_converted(tmp_path):
    table = read(text(tmp_path / "a.csv", "time [ms],vir (mV),qm [-]", ["0,1500,20", "1,-500,25", "2,0,30"]))
    assert table.units == {"time": "ms", "vir": "mV", "qm": ""}
    make_bundle(table, plan(columns={**MAP, "x": {"column": "qm", "unit": "mm"}}), tmp_path / "b")
    found = load_bundle(tmp_path / "b").columns
    assert found["t"].tolist() == [0.0, 0.001, 0.002]
    assert found["u"].tolist() == [1.5, -0.5, 0.0]
    assert found["x"] == pytest.approx([0.02, 0.025, 0.03], rel=1e-15)


def test_current_driven_rotary_axis_is_imported(tmp_path):
    table = read(text(tmp_path / "a.csv", "time,vir [mA],qm [deg]", ["0,100,0", "0.1,200,90", "0.2,100,180"]))
    make_bundle(table, plan(parameters={"J": 2e-4}), tmp_path / "b")
    found = load_bundle(tmp_path / "b")
    assert found.columns["x"] == pytest.approx([0, np.pi / 2, np.pi]) and found.columns["u"] == pytest.approx(
        [0.1, 0.2, 0.1]
    )
    assert (found.units["x"], found.units["u"]) == ("rad", "A")
    assert (found.case["sensors"], found.case["drive"]) == ({"unit": "rad"}, {"unit": "A"})


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("# from a scope\n% two\ntime;u;x\n0;1,5;2\n1;2,5;3\n", {"time": [0, 1], "u": [1.5, 2.5], "x": [2, 3]}),
        ("0,1,2\r\n1,2,3\r\n", {"1": [0, 1], "2": [1, 2], "3": [2, 3]}),
        ("time\tu\n0\t1e3\n\n1\t-2.5E-1\n", {"time": [0, 1], "u": [1000, -0.25]}),
        ('\ufeff"time [s]","a, b [V]"\n0,1\n1,2\n', {"time": [0, 1], "a, b": [1, 2]}),
    ],
)
def test_csv_dialects_are_read(tmp_path, content, expected):
    (tmp_path / "a.csv").write_text(content, encoding="utf-8", newline="")
    found = read(tmp_path / "a.csv").columns
    assert {name: values.tolist() for name, values in found.items()} == expected


def test_csv_of_another_code_page_is_read(tmp_path):
    (tmp_path / "a.csv").write_bytes("time [s],x [\u00b5m]\n0,1\n1,2\n".encode("latin-1"))
    assert read(tmp_path / "a.csv").units == {"time": "s", "x": "\u00b5m"}


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (["0,1,2", "1,nan,2", "2,,2"], r"a.csv: column 'vir', line 3, and 1 more: empty or nan; every row needs"),
        (["0,1,2", "1,1,oops", "2,1,2"], r"a.csv: column 'qm', line 3: 'oops' is not a number"),
        (["0,1,2", "", "1,1,inf", "2,1,2"], r"a.csv: column 'qm', line 4: inf"),
        (["0,1,2", "1,1,2", "1,1,2"], r"a.csv: time, line 4: 1 s after 1 s; time should increase"),
        (
            ["0,1,2", "1,1,2", "2,1,2", "5,1,2"],
            r"a.csv: time, line 5: 3 s after the row before where 1 s is usual.*--uneven",
        ),
        (["0,1,2", "1,1"], "a.csv: line 3 has 2 cells and the rows have 3; mend that line"),
        (["0,1,2"], "holds one row"),
        ([], "holds no rows"),
    ],
)
def test_invalid_row_is_named_in_the_error(tmp_path, rows, words):
    path = text(tmp_path / "a.csv", rows=rows)
    with pytest.raises(UserError, match=words):
        make_bundle(read(path), plan(), tmp_path / "b")
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"columns": {**MAP, "x": "qmm"}}, r"no column 'qmm' \(wanted as x\); is it 'qm'"),
        (
            {"columns": {**MAP, "x": {"column": "qm", "unit": "kg"}}},
            r"column 'qm' \(x\) is in 'kg', which is not m; --unit x=",
        ),
        ({"columns": {**MAP, "x": {"column": "qm", "unit": "furlong"}}}, "'furlong', which is not m"),
        ({"columns": {"t": "time", "u": "vir", "xx": "qm"}}, "a machine has no 'xx'; did you mean 'x'"),
        ({"columns": {"u": "vir", "x": "qm"}}, "no time column.*--rate 1000"),
        ({"rate": 500}, "time runs at 1000 rows a second where --rate says 500; one is wrong"),
        ({"plant": None}, "--plant: say what kind"),
        ({"columns": {}}, "has time, vir, qm; say which is which, e.g. --map"),
        ({"columns": {**MAP, "x_counts": "qm"}}, r"column 'qm', line 3: .* is not a whole number; a counter counts"),
        ({"columns": {**MAP, "ref": {"column": "qm", "unit": "rad"}}}, "x in m, ref in rad: position and reference"),
        ({"parameters": {"M": "95 m"}}, "--parameter M=95 m: '95 m' is not a quantity in kg"),
        ({"parameters": {"M": -1}}, "^parameters.M: -1.0 kg is out of bounds"),
        ({"case": {"delay_samples": -1}}, "delay_samples is -1"),
        ({"case": {"drive": 3}}, "--case drive=3: it holds keys of its own"),
        ({"case": {"other": float("nan")}}, "NaN and infinity are nothing"),
    ],
)
def test_invalid_import_plan_is_refused(tmp_path, given, words):
    path = text(tmp_path / "a.csv")
    with pytest.raises(UserError, match=words):
        make_bundle(read(path), plan(**given), tmp_path / "b")
    assert not (tmp_path / "b").exists()


def test_rate_replaces_a_missing_time_column(tmp_path):
    made = make_bundle(
        read(text(tmp_path / "a.csv")), plan(columns={"u": "vir", "x": "qm"}, rate="1 kHz"), tmp_path / "b"
    )
    assert made.rate == pytest.approx(1000.0, rel=1e-12)
    assert load_bundle(tmp_path / "b").columns["t"] == pytest.approx(T, abs=1e-12)


def test_uneven_clock_is_kept_on_request(tmp_path):
    t = np.cumsum(np.random.default_rng(1).uniform(0.2e-3, 1.8e-3, N))
    np.savez(tmp_path / "a.npz", time=t, vir=U, qm=X)
    made = make_bundle(read(tmp_path / "a.npz"), plan(uneven=True), tmp_path / "b")
    assert made.rate is None and np.array_equal(load_bundle(tmp_path / "b").columns["t"], t)
    assert load_record(tmp_path / "b").case.sample_rate is None


def test_columns_of_different_length_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", time=T, vir=U, qm=X[:-1])
    with pytest.raises(UserError, match="column 'qm' has 2499 rows where 'time' has 2500"):
        make_bundle(read(tmp_path / "a.npz"), plan(), tmp_path / "b")


def test_damaged_archive_and_folder_are_refused(tmp_path):
    (tmp_path / "a.npz").write_bytes(b"x" * 3000)
    with pytest.raises(UserError, match="cannot be read as npz: it is no archive of arrays"):
        read(tmp_path / "a.npz")
    with pytest.raises(UserError, match="is a folder; give the file in it"):
        read(tmp_path)


def test_existing_bundle_is_not_overwritten(tmp_path):
    table = read(text(tmp_path / "a.csv"))
    make_bundle(table, plan(), tmp_path / "b")
    with pytest.raises(UserError, match="already holds recording"):
        make_bundle(table, plan(), tmp_path / "b")


def test_structs_matrices_and_time_stamps_are_columns(tmp_path):
    savemat(tmp_path / "a.mat", {"log": {"y": np.column_stack((U, X)), "t": T[:, None]}, "gain": 3.0, "who": "me"})
    found = read(tmp_path / "a.mat").columns
    assert set(found) == {"log.y.1", "log.y.2", "log.t"} and np.array_equal(found["log.y.2"], X)
    stamps = np.datetime64("2026-01-01") + (T * 1e6).round().astype("timedelta64[us]")
    pq.write_table(pa.table({"at": stamps, "x": X}), tmp_path / "a.parquet")
    table = read(tmp_path / "a.parquet")
    assert np.array_equal(table.columns["at"], stamps) and table.units == {}
    assert table.times("at", 1.0) == pytest.approx(T, abs=1e-12)


def test_matlab_7_3_file_is_read(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"time": T, "vir": U, "qm": X}.items():
            file.create_dataset(f"log/{name}", data=values[None, :])  # column vector in MATLAB
        file.create_dataset("#refs#/a", data=T)
    table = read(path)
    assert set(table.columns) == {"log.time", "log.vir", "log.qm"} and np.array_equal(table.columns["log.qm"], X)


def test_matlab_7_3_without_its_package_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "a.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UserError, match=r"version 7.3 .*pip install 'rtctl\[hdf5\]'; or save it with -v7"):
        read(tmp_path / "a.mat")


def test_mcap_without_its_package_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "a.mcap").write_bytes(b"x")
    for name in [*sys.modules, "mcap"]:
        if name.partition(".")[0] == "mcap":
            monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "rtctl.trace.imports.mcap_file", raising=False)
    with pytest.raises(UserError, match="needs the package mcap: pip install mcap"):
        read(tmp_path / "a.mcap")


def test_each_mcap_topic_has_a_separate_clock(tmp_path):
    writer_of = pytest.importorskip("mcap.writer")
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = writer_of.Writer(file)
        writer.start()
        channels = [writer.register_channel(topic, "json", 0) for topic in ("/a", "/b")]
        for k in range(4):
            writer.add_message(channels[k % 2], 10**9 + k * 10**6, b'{"x": {"y": %d}, "s": "word"}' % k, 0)
        writer.finish()
    found = read(tmp_path / "a.mcap").columns
    assert {name: values.tolist() for name, values in found.items()} == {
        "/a/x.y": [0, 2], "/a/log_time": [0, 0.002], "/b/x.y": [1, 3], "/b/log_time": [0, 0.002]
    }  # fmt: skip


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".npz", ".parquet", ".mcap"])
@settings(deadline=None, max_examples=15)
@example(content=b"\x80\r")
@example(content=b"a\n" + b"1\n" * 40_000 + b"\x80\n")
@given(content=st.binary(max_size=200))
def test_damaged_files_give_an_error_message(tmp_path_factory, suffix, content):
    if suffix == ".mcap":
        pytest.importorskip("mcap")
    path = tmp_path_factory.mktemp("d") / f"a{suffix}"
    path.write_bytes(content)
    try:
        read(path)
    except UserError as error:
        assert str(path) in str(error)


def test_missing_file_and_unknown_format_are_refused(tmp_path):
    with pytest.raises(UserError, match="no such file"):
        read(tmp_path / "a.csv")
    (tmp_path / "a.xlsx").write_bytes(b"x")
    with pytest.raises(UserError, match=r"cannot import '.xlsx'; importable are .csv, .tsv"):
        read(tmp_path / "a.xlsx")


def test_options_override_the_map_file(tmp_path):
    path = tmp_path / "log.yaml"
    path.write_text("plant: axis\ncolumns:\n  u: vir\n  x: {column: qm, unit: mm}\ncase: {drive: {limit_volt: 10}}\n")
    found = with_options(
        load_plan(path), None, ["t=time,u=v2"], ["x=um"], "2kHz", ["M=95 kg"], ["drive.newton_per_volt=35.15"], False
    )
    assert {name: (c.column, c.unit) for name, c in found.columns.items()} == {
        "u": ("v2", None), "x": ("qm", "um"), "t": ("time", None)
    }  # fmt: skip
    assert found.rate == pytest.approx(2000) and found.parameters == {"M": "95 kg"}
    assert found.case == {"drive": {"limit_volt": 10, "newton_per_volt": 35.15}}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("plant: robot", r"log.yaml:1: .*plant.*axis"),
        ("plant: axis\ncolums: {x: q}", r"log.yaml:2: .*columns"),
        ("rate: 5 kg", r"log.yaml:1: .*rate.*Hz"),
        ("columns:\n  x: {colum: qm}", r"log.yaml:2"),
        ("columns:\n  x: 3", r"log.yaml:2"),
        ("columns: [x]", r"log.yaml:1"),
    ],
)
def test_invalid_map_file_is_refused(tmp_path, content, words):
    (tmp_path / "log.yaml").write_text(content)
    with pytest.raises(UserError, match=words):
        load_plan(tmp_path / "log.yaml")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"maps": ["x"]}, "--map x: write ours=theirs, e.g. x=qm"),
        ({"maps": ["x=qm,u=vir", "x=vir"]}, "--map: x cannot be both qm and vir"),
        ({"units": ["x="]}, "--unit x=: write"),
        ({"parameters": ["95"]}, "--parameter 95: write"),
        ({"case": ["drive=1", "drive.limit_volt=2"]}, "drive is a value and has no key 'limit_volt'"),
        ({"plant": "robot"}, "--plant"),
        ({"rate": "fast"}, "--rate"),
    ],
)
def test_invalid_import_options_are_refused(options, words):
    given = {"plant": None, "maps": [], "units": [], "rate": None, "parameters": [], "case": [], "uneven": False}
    with pytest.raises(UserError, match=words):
        with_options(Plan(), **{**given, **options})
