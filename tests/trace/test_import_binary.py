"""Binary formats: type and unit of each column, refused columns, and size limits before memory is allocated."""

import struct
import zlib
from decimal import Decimal

import numpy as np
import pyarrow as pa
import pyarrow.feather as feather
import pyarrow.parquet as pq
import pytest
from scipy import sparse
from scipy.io import savemat

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle
from rtctl.trace.imports import limits, read
from rtctl.trace.imports.make import make_bundle
from rtctl.trace.imports.plan import Plan

N = 50
T = np.arange(N) / 100
X = np.sin(T)


def kinds(table):
    return {name: values.dtype.kind for name, values in table.columns.items()}


def cell(*items):
    found = np.empty((1, len(items)), object)
    found[0, :] = items
    return found


@pytest.fixture
def small(monkeypatch):
    """A limit of 1 MiB."""
    monkeypatch.setenv(limits.VARIABLE, str(2**-10))


# MATLAB


def test_elements_of_struct_arrays_and_cells_are_columns(tmp_path):
    signals = np.array(
        [(X[:, None], "u", "V"), (2 * X[:, None], "x", "mm")], [("Data", "O"), ("Name", "O"), ("Unit", "O")]
    )
    savemat(tmp_path / "a.mat", {"rec": {"Y": signals, "X": {"Data": T, "Name": "time"}}, "data": cell(T, X)})
    table = read(tmp_path / "a.mat")
    assert set(table.columns) == {"rec.Y.1.Data", "rec.Y.2.Data", "rec.X.Data", "u", "x", "time", "data.1", "data.2"}
    assert np.array_equal(table.columns["rec.Y.2.Data"], 2 * X) and np.array_equal(table.columns["x"], 2 * X)
    assert table.units == {"rec.Y.1.Data": "V", "u": "V", "rec.Y.2.Data": "mm", "x": "mm"}
    make_bundle(table, Plan(plant="axis", columns={"t": "time", "u": "u", "x": "rec.Y.2.Data"}), tmp_path / "b")
    assert load_bundle(tmp_path / "b").columns["x"] == pytest.approx(2e-3 * X, rel=1e-14)


def test_units_next_to_signals_are_read_at_any_level(tmp_path):
    savemat(tmp_path / "a.mat", {"log": {"x": X, "y": np.column_stack((X, T)), "units": {"x": "mm", "y": "V"}}})
    assert read(tmp_path / "a.mat").units == {"log.x": "mm", "log.y.1": "V", "log.y.2": "V"}


def test_matlab_types_other_than_double_matrices(tmp_path):
    found = {
        "i8": (100 * X).astype("i1"), "b": X > 0.1, "simulink": X.reshape(1, 1, N), "cube": np.zeros((2, 3, N)),
        "s": sparse.csc_matrix(X[:, None]), "numbers": cell(*map(float, range(N))), "z": X + 1j * T, "word": "abc",
        "empty": np.empty((0, 0)), "gain": 3.0,
    }  # fmt: skip
    savemat(tmp_path / "a.mat", found, do_compression=True)
    table = read(tmp_path / "a.mat")
    cubes = {f"cube.{i}.{j}" for i in (1, 2) for j in (1, 2, 3)}
    assert set(table.columns) == {"i8", "b", "simulink", "s", "numbers", *cubes}
    assert np.array_equal(table.columns["s"], X) and np.array_equal(table.columns["numbers"], np.arange(N))
    assert table.notes == ("z is no column: complex numbers; write real and imaginary part as two columns",)
    with pytest.raises(UserError, match=r"'z' \(wanted as x\) is no column: complex numbers"):
        table.numbers("z", "x")
    with pytest.raises(UserError, match=r"'gain' \(wanted as x\) is no column: one value"):
        table.numbers("gain", "x")


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def variable(kind, shape, name, data):
    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack("<ii", *shape)) + element(1, name)
    return head + data


HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def test_matlab_datetime_is_refused_with_name_and_class(tmp_path):
    ids = element(14, variable(13, (6, 1), b"", element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))))
    parts = element(6, struct.pack("<II", 17, 0)) + element(1, b"when") + element(1, b"MCOS") + element(1, b"datetime")
    x = element(14, variable(6, (1, N), b"x", element(9, X.tobytes())))
    (tmp_path / "a.mat").write_bytes(HEAD + element(14, parts + ids) + x)
    table = read(tmp_path / "a.mat")
    assert set(table.columns) == {"x"}
    with pytest.raises(
        UserError, match=r"'when' .* is no column: a MATLAB object of class datetime.* seconds\(t - t\(1\)\)"
    ):
        table.times("when", 1.0)


@pytest.mark.parametrize("claim", ["tag", "shape"])
def test_matlab_file_that_unpacks_beyond_the_limit_is_refused_by_its_tags(tmp_path, small, claim):
    size = 16 << 20
    inner = variable(6, (1, size // 8), b"x", struct.pack("<II", 9, size))
    packed = zlib.compress(struct.pack("<II", 14, len(inner) + size) + inner + (bytes(size) if claim == "tag" else b""))
    (tmp_path / "a.mat").write_bytes(HEAD + struct.pack("<II", 15, len(packed)) + packed)
    assert (tmp_path / "a.mat").stat().st_size < 1 << 16
    with pytest.raises(
        UserError, match=r"its variables take 16 MiB in memory and 1 MiB are taken at most; .*RTCTL_IMPORT_GIB"
    ):
        read(tmp_path / "a.mat")


@pytest.mark.parametrize("version", ["4", "5"])
def test_truncated_matlab_file_is_refused(tmp_path, version):
    savemat(tmp_path / "a.mat", {"t": T, "x": X}, format=version)
    whole = (tmp_path / "a.mat").read_bytes()
    assert set(read(tmp_path / "a.mat").columns) == {"t", "x"}
    (tmp_path / "a.mat").write_bytes(whole[:-100])
    with pytest.raises(UserError, match=r"a.mat.*cannot be read.*damaged"):
        read(tmp_path / "a.mat")


@pytest.fixture
def h5():
    return pytest.importorskip("h5py")


def test_struct_arrays_cells_units_and_text_of_matlab_7_3(h5, tmp_path):
    with h5.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        refs = [file.create_dataset(f"#refs#/{k}", data=v[None, :]) for k, v in zip("ab", (X, 2 * X), strict=True)]
        file.create_group("scope").create_group("signals")
        file["scope/signals"]["values"] = np.array([[r.ref for r in refs]], h5.ref_dtype)
        file["cells"] = np.array([[r.ref for r in refs]], h5.ref_dtype)
        file["cells"].attrs["MATLAB_class"] = np.bytes_("cell")
        file["x"] = X[None, :]
        file["z"] = np.zeros((1, N), [("real", "f8"), ("imag", "f8")])
        file["when"] = np.zeros((1, 6), "u4")
        file["when"].attrs["MATLAB_class"] = np.bytes_("datetime")
        file.create_group("units")["x"] = np.array([[ord("m")], [ord("m")]], "u2")
        file["units/x"].attrs["MATLAB_class"] = np.bytes_("char")
    with (tmp_path / "a.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file")
    table = read(tmp_path / "a.mat")
    assert set(table.columns) == {"scope.signals.1.values", "scope.signals.2.values", "cells.1", "cells.2", "x"}
    assert np.array_equal(table.columns["scope.signals.2.values"], 2 * X) and table.units == {"x": "mm"}
    assert "class datetime" in table.left["when"] and "complex" in table.left["z"]


# HDF5


def test_hdf5_units_and_compound_types_are_read(h5, tmp_path):
    with h5.File(tmp_path / "a.h5", "w") as file:
        file["log/x"] = X
        file["log/x"].attrs["units"] = "mm"
        file["rows"] = np.array(list(zip(T, X, strict=True)), [("t", "f8"), ("u", "f8")])
        file["away"] = h5.ExternalLink("/etc/passwd", "x")
        file["round"] = h5.SoftLink("/")
    table = read(tmp_path / "a.h5")
    assert {"log.x", "rows.t", "rows.u"} <= set(table.columns) and table.units["log.x"] == "mm"
    assert table.left["away"] == "its data are in another file, which is not read"


def test_hdf5_that_declares_gigabytes_is_refused(h5, tmp_path):
    with h5.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("x", (1 << 34,), "f8", chunks=(1 << 16,), compression="gzip")
    with pytest.raises(UserError, match="its data sets take 128 GiB in memory and 2 GiB"):
        read(tmp_path / "a.h5")


# numpy


def test_numpy_types_are_columns_or_named(tmp_path):
    stamps = np.datetime64("2026-01-01") + np.arange(N).astype("timedelta64[ms]")
    np.savez(tmp_path / "a.npz", at=stamps, o=np.array([1, "a"], object), z=1j * X, text=np.array(["1.5"] * N),
             rows=np.zeros(N, [("a", "f8"), ("b", "i4")]), m=np.asfortranarray(np.column_stack((T, X))))  # fmt: skip
    table = read(tmp_path / "a.npz")
    assert kinds(table) == {"at": "M", "text": "O", "rows.a": "f", "rows.b": "i", "m.1": "f", "m.2": "f"}
    assert table.times("at", 1.0) == pytest.approx(np.arange(N) / 1000, abs=1e-15)
    assert np.array_equal(table.columns["m.2"], X) and table.numbers("text", "x")[3] == 1.5
    with pytest.raises(UserError, match=r"'o' .* pickled Python objects, which could run code and are never loaded"):
        table.has("o", "x")
    with pytest.raises(UserError, match="only t can be one"):
        table.numbers("at", "x")


def test_npz_archive_beyond_the_limit_is_refused_by_its_directory(tmp_path, small):
    np.savez_compressed(tmp_path / "a.npz", x=np.zeros(4 << 20))
    assert (tmp_path / "a.npz").stat().st_size < 1 << 16
    with pytest.raises(UserError, match="its arrays take 32 MiB in memory and 1 MiB are taken at most"):
        read(tmp_path / "a.npz")


def test_npy_header_that_declares_missing_data_is_refused(tmp_path):
    np.save(tmp_path / "a.npy", X)
    head = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(head.replace(b"(50,), }        ", b"(5000000000000,)"))
    with pytest.raises(UserError, match=r"a.npy"):
        read(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", np.column_stack((T, X)))
    assert set(read(tmp_path / "b.npy").columns) == {"column.1", "column.2"}


# Parquet and Arrow


def arrow_table():
    whole = range(N)
    return pa.table({
        "duration": pa.array(whole, pa.duration("us")),
        "stamp": pa.array([17 * 10**17 + k * 1000 for k in whole], pa.timestamp("ns", tz="Europe/Berlin")),
        "clock": pa.array(whole, pa.time64("ns")),
        "decimal": pa.array([Decimal(k) / 8 for k in whole], pa.decimal128(10, 3)),
        "category": pa.array([1.5, 2.5] * 25).dictionary_encode(),
        "text": pa.array([str(k) for k in whole]),
        "flag": pa.array([True, False] * 25),
        "gap": pa.array([None, *range(1, N)], pa.int64()),
        "pair": pa.array([[k, k + 1.0] for k in whole], pa.list_(pa.float64(), 2)),
        "list": pa.array([[k, 1] for k in whole]),
        "ragged": pa.array([[k] * (k % 3) for k in whole]),
        "struct": pa.array([{"a": k, "b": {"c": 1.0 * k}} for k in whole]),
        "bytes": pa.array([b"x"] * N),
    })  # fmt: skip


EXPECTED = {
    "duration": "m", "stamp": "M", "clock": "m", "decimal": "f", "category": "f", "text": "O", "flag": "b", "gap": "f",
    "pair.1": "f", "pair.2": "f", "list.1": "i", "list.2": "i", "struct.a": "i", "struct.b.c": "f",
}  # fmt: skip


@pytest.mark.parametrize("kind", ["parquet", "feather"])
def test_arrow_types_are_columns_or_named(tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    (pq.write_table if kind == "parquet" else feather.write_feather)(arrow_table(), path)
    table = read(path)
    assert kinds(table) == EXPECTED and table.units == {}
    assert table.times("duration", 1.0) == pytest.approx(np.arange(N) * 1e-6, abs=1e-18)
    assert table.times("stamp", 1.0) == pytest.approx(np.arange(N) * 1e-6, abs=1e-18)
    assert table.columns["decimal"][3] == 0.375 and table.columns["pair.2"][3] == 4.0
    assert table.left == {
        "ragged": "lists of 0 to 2 elements; write one column for each element", "bytes": "values of type binary"
    }  # fmt: skip
    with pytest.raises(UserError, match=r"column 'gap', row 0: empty or nan"):
        table.numbers("gap", "x")
    with pytest.raises(UserError, match=r"'duration' \(wanted as x\) holds dates or durations; only t can be one"):
        table.numbers("duration", "x")


@pytest.mark.parametrize("key", ["unit", "units"])
def test_units_are_read_from_field_metadata(tmp_path, key):
    field = pa.field("x", pa.float64(), metadata={key: "mm"})
    pq.write_table(pa.table({"x": X}, schema=pa.schema([field])), tmp_path / "a.parquet")
    assert read(tmp_path / "a.parquet").units == {"x": "mm"}


def test_parquet_beyond_the_limit_is_refused_by_its_metadata(tmp_path, small):
    pq.write_table(pa.table({name: np.zeros(1 << 18) for name in "abcd"}), tmp_path / "a.parquet")
    assert (tmp_path / "a.parquet").stat().st_size < 1 << 16
    with pytest.raises(UserError, match="its columns take 8 MiB in memory and 1 MiB are taken at most"):
        read(tmp_path / "a.parquet")


def test_invalid_import_limit_is_an_error(monkeypatch):
    monkeypatch.setenv(limits.VARIABLE, "much")
    with pytest.raises(UserError, match="RTCTL_IMPORT_GIB=much: it should be a number of GiB, such as 4"):
        limits.limit()


# any


def test_file_with_a_wrong_extension_is_read_by_content_with_a_note(tmp_path):
    pq.write_table(pa.table({"t": T, "x": X}), tmp_path / "a.csv")
    with (tmp_path / "b.mat").open("wb") as file:
        np.savez(file, t=T)
    table = read(tmp_path / "a.csv")
    assert np.array_equal(table.columns["x"], X) and table.notes == (
        "a.csv is read as parquet, which it is by its content",
    )
    assert set(read(tmp_path / "b.mat").columns) == {"t"}


def test_error_for_a_file_without_columns_lists_its_content(tmp_path):
    savemat(tmp_path / "a.mat", {"gain": 3.0, "word": "abc"})
    with pytest.raises(
        UserError, match=r"a.mat has no column of numbers; gain is one value and no column; word is text"
    ):
        make_bundle(read(tmp_path / "a.mat"), Plan(plant="axis"), tmp_path / "b")
