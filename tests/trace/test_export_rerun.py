"""The reader of Rerun finds scalars, timelines and panels of an exported recording, and messages of an MCAP file."""

import numpy as np
import pyarrow as pa
import pytest

from rtctl.config.errors import UserError
from rtctl.trace.bundle import save_case, write_parquet
from rtctl.trace.export import Selection, export, source

chunk = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed")
ROWS = 500
BEGAN_NS = 1795257868 * 10**9
UNITS = {"t": "s", "ref": "rad", "capstan.d": "rad", "u1": "V", "tick": "1", "on": ""}


@pytest.fixture
def bundle(tmp_path, monkeypatch):
    monkeypatch.delenv("RERUN", raising=False)
    monkeypatch.setattr(source, "ROW_GROUP", 90)
    folder = tmp_path / "b"
    folder.mkdir()
    k = np.arange(ROWS)
    values = {
        "t": k / 500,
        "ref": np.sin(k / 9),
        "capstan.d": np.where(k % 7, k / 3, np.nan),
        "u1": -k / 2,
        "tick": k,
        "on": k % 2 == 0,
    }
    fields = [
        pa.field(name, pa.from_numpy_dtype(v.dtype), metadata={"unit": UNITS[name]}) for name, v in values.items()
    ]
    write_parquet(folder, [pa.record_batch(list(values.values()), schema=pa.schema(fields))], pa.schema(fields))
    save_case(folder, {"format": 1, "plant": "ivu", "sample_rate": 500.0, "recorded_at": "2026-11-21T10:44:28+00:00"})
    return folder, values


def series(reader, entity):
    """Scalars and timelines of an entity, sorted by `t`."""
    found = [c.to_record_batch() for c in reader.stream() if c.entity_path == entity and not c.is_static]
    columns = {}
    for name in ("t", "time"):
        columns[name] = np.concatenate([b.column(name).cast(pa.int64()).to_numpy() for b in found])
    columns["scalar"] = np.concatenate([b.column("Scalars:scalars").flatten().to_numpy() for b in found])
    order = np.argsort(columns["t"])
    return {name: values[order] for name, values in columns.items()}


def test_every_signal_is_a_scalar_series_on_both_timelines(bundle):
    folder, values = bundle
    reader = chunk.RrdReader(export(folder, "rrd").path)
    entities = {c.entity_path for c in reader.stream()}
    assert {f"/ivu/{name}" for name in values} <= entities and "/case" in entities
    for name, expected in values.items():
        found = series(reader, f"/ivu/{name}")
        assert np.array_equal(found["scalar"], np.asarray(expected, float), equal_nan=True)
        assert np.array_equal(found["t"], np.rint(values["t"] * 1e9).astype(int))
        assert np.array_equal(found["time"], BEGAN_NS + found["t"])


def test_names_have_units_and_each_panel_has_one_unit(bundle):
    reader = chunk.RrdReader(export(bundle[0], "rrd").path)
    titles = {
        c.entity_path: c.to_record_batch().column("SeriesLines:names").to_pylist()[0][0]
        for c in reader.stream() if c.is_static and c.entity_path.startswith("/ivu/")
    }  # fmt: skip
    assert titles["/ivu/ref"] == "ref [rad]" and titles["/ivu/tick"] == "tick"
    (blueprint,) = reader.blueprints()
    queries = [
        sorted(batch.column("ViewContents:query").to_pylist()[0])
        for c in reader.stream(store=blueprint)
        if "ViewContents:query" in (batch := c.to_record_batch()).schema.names
    ]
    assert sorted(queries) == [["+ /ivu/capstan.d", "+ /ivu/ref"], ["+ /ivu/on", "+ /ivu/tick"], ["+ /ivu/u1"]]


def test_selected_columns_and_rows_are_exported(bundle):
    folder, values = bundle
    found = series(chunk.RrdReader(export(folder, "rrd", None, Selection(("u1",), 0.1, 0.5, 3)).path), "/ivu/u1")
    assert found["scalar"].tolist() == values["u1"][50:251:3].tolist()


def test_disabled_rerun_is_an_error(bundle, monkeypatch):
    monkeypatch.setenv("RERUN", "off")
    with pytest.raises(UserError, match="take RERUN=off out of the environment"):
        export(bundle[0], "rrd")
    assert not (bundle[0] / "trace.rrd").exists()


def test_rerun_decodes_an_exported_mcap_file(bundle):
    folder, values = bundle
    found = [c.to_record_batch() for c in chunk.McapReader(export(folder, "mcap").path).stream()
             if c.entity_path == "/ivu" and not c.is_static]  # fmt: skip
    rows = pa.concat_arrays([b.column("rtctl.ivu:message").flatten() for b in found])
    assert np.array_equal(np.sort(rows.field("u1").to_numpy()), np.sort(values["u1"]))
    assert rows.field("tick").type == pa.int64() and len(rows) == ROWS
