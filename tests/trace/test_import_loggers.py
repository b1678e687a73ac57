"""MDF and TDMS: units, groups, separate clocks; round trip of exported files."""

import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle, save_case
from rtctl.trace.compare import compare
from rtctl.trace.export import FORMATS, export
from rtctl.trace.imports import READERS, limits, read
from rtctl.trace.imports.make import known_columns, make_bundle
from rtctl.trace.imports.plan import Plan

T = np.arange(100) / 100
X = np.sin(T)
READ = [name for name, form in FORMATS.items() if form.suffix in READERS]


def bundle(folder, rows=2500):
    """A bundle with every column of an axis, units in the file, numbers of full precision."""
    columns = known_columns("axis")
    values = {name: np.sin(np.arange(rows) * 0.01 + k) for k, name in enumerate(columns)}
    values["t"] = np.arange(rows) / 1000
    values |= {name: np.round(100 * values[name]) for name in columns if name.endswith("_counts")}
    fields = [pa.field(c.name, pa.float64(), metadata={"unit": c.unit}) for c in columns.values()]
    folder.mkdir()
    pq.write_table(pa.table(values, schema=pa.schema(fields)), folder / "recording.parquet")
    save_case(folder, {"format": 1, "plant": "axis", "sample_rate": 1000.0})
    return folder


@pytest.mark.parametrize("to", READ)
def test_exported_files_import_with_equal_numbers_and_units(tmp_path, to):
    if FORMATS[to].package:
        pytest.importorskip(FORMATS[to].package)
    path = export(bundle(tmp_path / "a"), to, tmp_path / f"a{FORMATS[to].suffix}").path
    made = make_bundle(read(path), Plan(plant="axis"), tmp_path / "b")
    found = compare(tmp_path / "a", tmp_path / "b")
    assert len(found.signals) == len(known_columns("axis"))
    assert not found.different and not found.only_a and not found.only_b
    assert load_bundle(tmp_path / "b").units == {n: c.unit for n, c in known_columns("axis").items() if c.unit}
    assert made.rate == 1000.0 and made.notes == ()


def test_every_export_format_except_rerun_can_be_imported():
    assert set(FORMATS) - set(READ) == {"rrd"}  # export to Rerun is for viewing only


@pytest.fixture
def mdf(tmp_path):
    asammdf = pytest.importorskip("asammdf")

    def write(*groups):
        with asammdf.MDF(version="4.10") as file:
            for name, t, signals in groups:
                made = [asammdf.Signal(v, t, name=n, unit=u, **more) for n, v, u, more in signals]
                file.append(made, acq_name=name, common_timebase=True)
            file.save(tmp_path / "a.mf4", overwrite=True, compression=2)
        return tmp_path / "a.mf4"

    return write


def test_mdf_groups_of_one_clock_are_merged(mdf, tmp_path):
    table = read(mdf(("a", T, [("u", X, "V", {})]), ("b", T, [("x", X, "mm", {}), ("n", np.arange(100), "", {})])))
    assert set(table.columns) == {"time", "u", "x", "n"} and table.clock == "time" and table.notes == ()
    assert table.units == {"time": "s", "u": "V", "x": "mm"} and table.columns["n"].dtype.kind == "i"
    make_bundle(table, Plan(plant="axis"), tmp_path / "b")
    assert load_bundle(tmp_path / "b").columns["x"] == pytest.approx(X / 1e3, rel=1e-14)


def test_mdf_groups_with_separate_clocks_are_prefixed(mdf, tmp_path):
    table = read(mdf(("fast", T, [("x", X, "mm", {})]), ("slow", T[::10], [("x", X[::10], "V", {})])))
    assert set(table.columns) == {"fast/time", "fast/x", "slow/time", "slow/x"} and table.clock == ""
    assert table.notes[0].startswith("its channel groups have clocks of their own: fast (100 rows), slow (10 rows)")
    with pytest.raises(UserError, match="column 'slow/x' has 10 rows where 'fast/time' has 100"):
        make_bundle(table, Plan(plant="axis", columns={"t": "fast/time", "x": "slow/x"}), tmp_path / "b")


def test_invalid_mdf_values_become_nan(mdf):
    invalid = np.arange(100) == 7
    table = read(mdf(("a", T, [("x", X, "mm", {"invalidation_bits": invalid})])))
    with pytest.raises(UserError, match="column 'x', row 7: empty or nan"):
        table.numbers("x", "x")


def test_mdf_and_tdms_beyond_the_limit_are_refused(mdf, tdms, monkeypatch):
    t = np.arange(200_000) / 1000
    paths = mdf(("a", t, [("x", 0 * t, "", {})])), tdms({"g": {"x": (np.zeros(200_000), {})}})
    monkeypatch.setenv(limits.VARIABLE, str(2**-10))
    for path in paths:
        with pytest.raises(UserError, match=r"its channels take .* MiB in memory and 1 MiB are taken at most"):
            read(path)


@pytest.fixture
def tdms(tmp_path):
    nptdms = pytest.importorskip("nptdms")

    def write(groups):
        with nptdms.TdmsWriter(str(tmp_path / "a.tdms")) as file:
            file.write_segment([
                nptdms.ChannelObject(group, name, values, properties)
                for group, channels in groups.items()
                for name, (values, properties) in channels.items()
            ])  # fmt: skip
        return tmp_path / "a.tdms"

    return write


def wave(step, unit="mm", start=0.0):
    return {"unit_string": unit, "wf_increment": step, "wf_start_offset": start}


def test_tdms_waveforms_have_a_clock(tdms, tmp_path):
    table = read(tdms({"g": {"x": (X, wave(0.01, start=2.0)), "u": (X, wave(0.01, "V", 2.0))}}))
    assert table.clock == "wf_time" and table.units == {"x": "mm", "u": "V", "wf_time": "s"}
    made = make_bundle(table, Plan(plant="axis"), tmp_path / "b")
    assert made.rate == 100.0 and load_bundle(tmp_path / "b").columns["t"][[0, -1]].tolist() == [2.0, 2.99]


def test_tdms_waveforms_with_separate_clocks_are_prefixed(tdms):
    table = read(tdms({"g": {"x": (X, wave(0.01))}, "h": {"u": (X[::10], wave(0.1))}}))
    assert set(table.columns) == {"g/x", "h/u", "g/x.wf_time", "h/u.wf_time"} and table.clock == ""
    assert "g/x 100 Hz (100 rows), h/u 10 Hz (10 rows)" in table.notes[0]


def test_tdms_time_stamps_and_empty_channels(tdms):
    stamps = np.datetime64("2026-01-01") + (T * 1e6).round().astype("timedelta64[us]")
    table = read(tdms({"g": {"at": (stamps, {}), "none": (np.empty(0), {})}}))
    assert table.times("at", 1.0) == pytest.approx(T, abs=1e-9) and table.left == {"none": "empty"}


@pytest.mark.parametrize(
    ("name", "package", "extra"),
    [("a.mf4", "asammdf", "'rtctl[mf4]'"), ("a.tdms", "nptdms", "'rtctl[tdms]'"), ("a.h5", "h5py", "'rtctl[hdf5]'")],
)
def test_missing_package_error_names_the_extra(tmp_path, monkeypatch, name, package, extra):
    (tmp_path / name).write_bytes(b"x")
    for module in [*sys.modules, package]:
        if module.partition(".")[0] == package:
            monkeypatch.setitem(sys.modules, module, None)
    for reader in ("mf4_file", "tdms_file", "hdf5_file"):
        monkeypatch.delitem(sys.modules, f"rtctl.trace.imports.{reader}", raising=False)
    with pytest.raises(
        UserError, match=rf"{name} .*needs the package {package}: pip install {extra}".replace("[", r"\[")
    ):
        read(tmp_path / name)


@pytest.mark.parametrize("name", ["a.mf4", "a.tdms", "a.h5", "a.json", "a.jsonl", "a.npy", "a.feather", "a.csv.gz"])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.97])
def test_damaged_mdf_and_tdms_files_give_an_error_message(tmp_path, name, share, request):
    """Each file truncated, and with its second half overwritten: only a UserError is raised."""
    whole = make_file(tmp_path / name, request)
    cut = int(share * len(whole))
    for content in (whole[:cut], whole[:cut] + b"\xa5" * (len(whole) - cut)):
        (tmp_path / name).write_bytes(content)
        try:
            read(tmp_path / name)
        except UserError as error:
            assert str(tmp_path / name) in str(error) and "\n" not in str(error)


def make_file(path, request):
    if path.suffix == ".mf4":
        return request.getfixturevalue("mdf")(("a", T, [("x", X, "mm", {})])).read_bytes()
    if path.suffix == ".tdms":
        return request.getfixturevalue("tdms")({"g": {"x": (X, wave(0.01))}}).read_bytes()
    if path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            file["x"] = X
    elif path.suffix in (".json", ".jsonl"):
        end = "\n" if path.suffix == ".jsonl" else ","
        rows = end.join(f'{{"t": {t}}}' for t in T)
        path.write_text(rows if path.suffix == ".jsonl" else f"[{rows}]")
    elif path.suffix == ".npy":
        np.save(path, X)
    elif path.suffix == ".feather":
        pytest.importorskip("pyarrow.feather").write_feather(pa.table({"x": X}), path)
    else:
        path.write_bytes(pytest.importorskip("gzip").compress(b"t,x\n" + b"0,1\n" * 100))
    return path.read_bytes()
