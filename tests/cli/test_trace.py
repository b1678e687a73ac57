import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest


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


def test_info(rtctl, bundle):
    code, out, _ = rtctl("trace", "info", bundle)
    assert code == 0
    assert "tick, t, ref, x" in out
    found = json.loads(rtctl("trace", "info", bundle, "--json").out)
    assert (found["rows"], found["duration_s"], found["plant"]) == (100, 0.99, "axis")
    assert found["lost_rows"] is None


def test_plot(rtctl, bundle, tmp_path):
    code, out, _ = rtctl("trace", "plot", bundle, "-o", tmp_path / "picture.png")
    assert (code, out) == (0, f"{tmp_path / 'picture.png'}\n")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert rtctl("trace", "plot", bundle, "-o", tmp_path / "nowhere" / "picture.png").code == 2


def test_repair_of_what_is_whole(rtctl, bundle):
    code, out, _ = rtctl("trace", "repair", bundle)
    assert code == 0
    assert "nothing to repair, 100 rows" in out


@pytest.mark.parametrize("command", ["info", "plot", "repair"])
def test_what_is_no_bundle(rtctl, command, tmp_path):
    code, out, err = rtctl("trace", command, tmp_path)
    assert (code, out) == (2, "")
    assert str(tmp_path) in err
