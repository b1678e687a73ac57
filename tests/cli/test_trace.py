import csv
import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rtctl.cli import main


@pytest.fixture
def bundle(tmp_path):
    """A second at 100 Hz of a step on an axis."""
    folder = tmp_path / "bundle"
    folder.mkdir()
    t = np.arange(100) * 0.01
    ref = np.where(t < 0.5, 0.0, 0.001)
    pq.write_table(pa.table({"tick": np.arange(100), "t": t, "ref": ref, "x": ref}), folder / "recording.parquet")
    (folder / "case.json").write_text(
        json.dumps({"format": 1, "plant": "axis", "sample_rate": 100.0, "parameters": {}})
    )
    return folder


def test_trace_info(rtctl, bundle):
    code, out, _ = rtctl("trace", "info", bundle)
    assert code == 0
    assert "tick, t, ref, x" in out
    found = json.loads(rtctl("trace", "info", bundle, "--json").out)
    assert (found["rows"], found["duration_s"], found["plant"]) == (100, 0.99, "axis")
    assert found["lost_rows"] is None


def test_trace_plot(rtctl, bundle, tmp_path):
    code, out, _ = rtctl("trace", "plot", bundle, "-o", tmp_path / "picture.png")
    assert (code, out) == (0, f"{tmp_path / 'picture.png'}\n")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "is a folder; name a file that ends in .png"),
        ("picture", "is no kind of picture; name a file that ends in .png"),
        ("picture.xyz", "is no kind of picture; name a file that ends in .png"),
        ("nowhere/picture.png", "cannot be written (there is no folder"),
    ],
)
def test_invalid_picture_is_refused(rtctl, bundle, tmp_path, name, message):
    for words in (["plot", bundle, "-o", tmp_path / name], ["compare", bundle, bundle, "--plot", tmp_path / name]):
        code, out, err = rtctl("trace", *words)
        assert (code, out) == (2, "")
        assert message in err and str(tmp_path / name) in err and err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == [bundle.name]


def test_repair_of_a_complete_bundle_does_nothing(rtctl, bundle):
    code, out, _ = rtctl("trace", "repair", bundle)
    assert code == 0
    assert "nothing to repair, 100 rows" in out


@pytest.mark.parametrize("command", ["info", "plot", "repair"])
def test_folder_that_is_not_a_bundle_is_an_error(rtctl, command, tmp_path):
    code, out, err = rtctl("trace", command, tmp_path)
    assert (code, out) == (2, "")
    assert str(tmp_path) in err


@pytest.fixture
def recorded(bundle):
    """Bundle with the data of a run: timing, an order, and parts in the case."""
    case = json.loads((bundle / "case.json").read_text())
    stage = {"count": 100, "p50": 1.25, "p99": 3.5, "p999": 8.0, "max": 9.0, "buckets": [[1250.0, 100]]}
    case["timing"] = {"read": stage, "wake": {**stage, "count": 0}}
    case["parts"] = [{"folder": "part-0001", "rows": 100, "tick": [0, 99], "t": [0.0, 0.99]}]
    (bundle / "case.json").write_text(json.dumps(case))
    order = {"order": 1, "command": {"order": 1}, "changed": {"law.position.gain": 20}}
    (bundle / "orders.jsonl").write_text(json.dumps(order) + "\n")
    return bundle


def test_info_prints_timing_orders_and_parts(rtctl, recorded):
    lines = [line.split() for line in rtctl("trace", "info", recorded).out.splitlines()]
    assert ["timing", "[us]", "p50", "p99", "max", "ticks"] in lines
    assert ["read", "1.25", "3.5", "9", "100"] in lines and not any(line[0] == "wake" for line in lines)
    assert ["orders", "1,", "which", "changed", "law.position.gain"] in lines
    assert ["part-0001", "100", "rows,", "0", "s", "to", "0.99", "s"] in lines
    found = json.loads(rtctl("trace", "info", recorded, "--json").out)
    assert found["timing_us"]["read"] == {"count": 100, "p50": 1.25, "p99": 3.5, "max": 9.0}
    assert (found["orders"], found["settings_changed"], len(found["parts"])) == (1, ["law.position.gain"], 1)


def test_trace_export(rtctl, bundle, tmp_path):
    assert rtctl("trace", "export", bundle, "--to", "csv") == (0, f"{bundle / 'trace.csv'}\n", "")
    words = ("--columns", "ref, x", "--from", "0s", "--to-time", "500ms", "--every", 10, "--json")
    done = json.loads(rtctl("trace", "export", bundle, "--to", "csv", "-o", tmp_path / "a.csv", *words).out)
    assert (done["path"], done["rows"], done["columns"]) == (str(tmp_path / "a.csv"), 6, ["t", "ref", "x"])
    with (tmp_path / "a.csv").open(newline="") as file:
        assert [row[0] for row in csv.reader(file)] == ["t", "0", "0.1", "0.2", "0.3", "0.4", "0.5"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--to", "xls"], "no format 'xls'"),
        (["--to", "csv", "--from", "soon"], "--from soon: not a duration"),
        (["--to", "csv", "--every", "0"], "invalid value for '--every'"),
        (["--to", "csv", "--from", "-2s", "--to-time", "-1s"], "holds no rows from -2 s to -1 s"),
        (["--to", "csv", "--from", "500s"], "holds no rows from 500 s on; its column t runs from 0 s to 0.99 s"),
        (["--to", "csv", "--to-time", "-1s"], "holds no rows to -1 s; its"),
        ([], "missing option '--to'"),
    ],
)
def test_invalid_export_is_refused(rtctl, bundle, words, message):
    code, out, err = rtctl("trace", "export", bundle, *words)
    assert (code, out) == (2, "") and message in err and err.count("\n") == 1


def test_trace_compare(rtctl, bundle, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    table = pq.read_table(bundle / "recording.parquet")
    x = table.column("x").to_numpy() * 1.25
    pq.write_table(table.set_column(3, "x", pa.array(x)), other / "recording.parquet")
    (other / "case.json").write_bytes((bundle / "case.json").read_bytes())
    code, out, _ = rtctl("trace", "compare", bundle, other, "--plot", tmp_path / "a.png")
    assert code == 0 and "tick 50 (0.5 s)" in out and "the same to the bit: tick, t, ref" in out
    assert [line.split() for line in out.splitlines()][-1] == ["1", "0", "-0.25", "0", "25", "0", "-"]
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert rtctl("trace", "compare", bundle, other, "--same").code == 1
    assert rtctl("trace", "compare", bundle, other, "--same", "--columns", "ref").code == 0
    assert rtctl("trace", "compare", bundle, bundle, "--same").code == 0
    found = json.loads(rtctl("trace", "compare", bundle, other, "--json").out)
    assert (found["same"], found["aligned"], found["ticks"]) == (False, "tick", 100)
    assert rtctl("trace", "compare", bundle, other, "--align", "eye").code == 2


def test_trace_import(rtctl, monkeypatch, tmp_path):
    monkeypatch.setitem(main.COMMANDS, "import", "import_")
    t = np.arange(3000) * 0.001
    rows = [f"{a!r},{b!r},{c!r}" for a, b, c in zip(t.tolist(), np.cos(t).tolist(), np.sin(t).tolist(), strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time,vir,qm", *rows]))
    words = ("--map", "t=time,u=vir", "--map", "x=qm", "--unit", "x=mm", "--plant", "axis", "--parameter", "M=95 kg")
    code, out, _ = rtctl("import", tmp_path / "a.csv", "--out", tmp_path / "b", *words)
    assert code == 0 and out.startswith("3000 rows at 1000 Hz: t [s], u [V], x [m], w [V]\n")
    assert "diagnose would say" not in out
    found = json.loads(rtctl("trace", "info", tmp_path / "b", "--json").out)
    assert (found["plant"], found["sample_rate_hz"], found["columns"]["x"]) == ("axis", 1000.0, "m")
    code, out, err = rtctl("import", tmp_path / "a.csv", "--out", tmp_path / "b", *words)
    assert (code, out) == (2, "") and "already holds" in err
    code, _, err = rtctl("import", tmp_path / "a.csv", "--out", tmp_path / "c", "--map", "x=qmm", "--plant", "axis")
    assert code == 2 and "no column 'qmm' (wanted as x); is it 'qm'?" in err


def test_import_reports_the_data_that_a_diagnosis_needs(rtctl, monkeypatch, tmp_path):
    monkeypatch.setitem(main.COMMANDS, "import", "import_")
    np.savez(tmp_path / "a.npz", t=np.arange(10) * 0.1, x=np.arange(10.0), u=np.arange(10.0))
    found = json.loads(rtctl("import", tmp_path / "a.npz", "--out", tmp_path / "b", "--plant", "axis", "--json").out)
    assert found["rows"] == 10 and "needs 500" in found["lacks"]
