"""A bundle in a notebook: columns, tables, figures."""

import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import pyarrow as pa
import pytest
from trace_rows import CASE, COLUMNS, ROW, make

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle, save_case, write_parquet
from rtctl.trace.columns import record_batch, schema

ROWS = 500


@pytest.fixture
def bundle(tmp_path):
    whole = schema(COLUMNS, ROW)
    write_parquet(tmp_path, [record_batch(make(0, ROWS), whole)], whole)
    save_case(tmp_path, CASE)
    return load_bundle(tmp_path)


def test_bundle_column_is_found_by_name(bundle):
    np.testing.assert_array_equal(bundle["u1"], bundle.columns["u1"])
    with pytest.raises(UserError, match=r"has no column 'u11'; did you mean 'u1'\?"):
        bundle["u11"]


def test_bundle_has_rows_and_names(bundle):
    assert len(bundle) == ROWS
    assert list(bundle) == list(bundle.columns)


def test_bundle_repr_is_one_short_line(bundle):
    assert repr(bundle).startswith(f"<Bundle {bundle.folder}: ")
    assert f"{ROWS} rows" in repr(bundle)
    assert len(repr(bundle)) < 200 + len(str(bundle.folder))


def test_html_table_has_units_and_escaped_names(bundle):
    page = bundle._repr_html_()
    assert "<th>u1</th><td>V</td>" in page
    odd = replace(bundle, columns={**bundle.columns, "<b>": np.full(ROWS, np.nan)})
    assert "<th>&lt;b&gt;</th>" in odd._repr_html_()
    assert "no number" in odd._repr_html_()


def test_arrow_reads_a_bundle_directly(bundle):
    table = pa.table(bundle)
    assert table.num_rows == ROWS
    assert table.field("u1").metadata == {b"unit": b"V"}
    np.testing.assert_array_equal(table.column("u1").to_numpy(), bundle["u1"])


def test_duckdb_reads_a_bundle(bundle):
    duckdb = pytest.importorskip("duckdb")
    recording = pa.table(bundle)  # noqa: F841  duckdb finds it by its name
    assert duckdb.sql("select count(*) from recording").fetchall() == [(ROWS,)]


def test_bundle_to_pandas(bundle):
    pytest.importorskip("pandas")
    frame = bundle.to_pandas()
    assert frame.index.name == "t"
    assert frame.attrs["units"]["u1"] == "V"
    np.testing.assert_array_equal(frame["u1"], bundle["u1"])


def test_bundle_to_xarray(bundle, monkeypatch):
    """Arguments of an xarray Dataset; xarray is stubbed, since the development environment lacks it."""
    there = ModuleType("xarray")
    there.Dataset = lambda values, coords, attrs: (values, coords, attrs)
    monkeypatch.setitem(sys.modules, "xarray", there)
    values, coords, attrs = bundle.to_xarray()
    along, v, about = values["u1"]
    assert (along, about) == ("t", {"units": "V"})
    np.testing.assert_array_equal(v, bundle["u1"])
    assert "t" not in values
    assert coords["t"][2] == {"units": "s"}
    assert attrs == {"folder": str(bundle.folder)}


def test_missing_library_error_names_the_extra(bundle, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(UserError, match=r"needs the package xarray: pip install 'rtctl\[notebook\]'"):
        bundle.to_xarray()


def test_figure_has_one_panel_per_unit(bundle):
    names = [name for name in bundle if bundle.units.get(name)]
    figure = bundle.plot(*names)
    assert len(figure.axes) == len({bundle.units[name] for name in names})
    assert {line.get_label() for axes in figure.axes for line in axes.get_lines()} == set(names)
    assert len(bundle.plot().axes) >= 1
    with pytest.raises(UserError, match="has no column"):
        bundle.plot("nothing")


def test_notebook_cell_shows_a_figure_without_pyplot(tmp_path):
    import pickle

    from matplotlib.figure import Figure

    from rtctl.trace.notebook import in_cell

    figure = in_cell(Figure())
    figure.subplots().plot([1.0, 2.0])
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert pickle.loads(pickle.dumps(figure))._repr_png_().startswith(b"\x89PNG")
