"""Recordings of public repositories as CSV: names, times, and repeated rows."""

import gzip
import importlib.util

import numpy as np
import pytest
import yaml
from real_cases import FOLDER

spec = importlib.util.spec_from_file_location("public", FOLDER / "public.py")
assert spec is not None and spec.loader is not None
public = importlib.util.module_from_spec(spec)
spec.loader.exec_module(public)


@pytest.mark.parametrize("text", ["a,b\n0, 1\n11, -2\n", "#a\tb\n0\t1\n11\t-2\n", "0 1\n11 -2"])
def test_rows_are_read_from_any_text(text):
    assert public.rows_of(text).tolist() == [[0.0, 1.0], [11.0, -2.0]]


def test_columns_get_names_and_times_in_seconds():
    source = public.Source("a/b", "0", "f", {"t": 0, "x": 2, "push": 1}, every=2, milliseconds=True, centred="push")
    found = public.prepared(source, "100,1,5\n110,1,5\n120,3,6\n130,3,6\n")
    assert {name: values.tolist() for name, values in found.items()} == {
        "t": [0.0, 0.02], "x": [5.0, 6.0], "push": [-1.0, 1.0]}  # fmt: skip


def test_available_recordings_are_written_and_missing_ones_named(tmp_path, capsys):
    source = public.SOURCES["micromouse"]
    file = tmp_path / source.repository / source.file
    file.parent.mkdir(parents=True)
    file.write_text("time, targetSpeed, leftSpeed, leftCommand\n10, 200, 0.5, 2\n21, 200, 1.5, 3\n")
    public.main(tmp_path, tmp_path / "out")
    with gzip.open(tmp_path / "out" / "micromouse.csv.gz", "rt") as written:
        assert written.readline().strip() == "t,speed,command"
        assert np.loadtxt(written, delimiter=",").tolist() == [[0.0, 0.5, 2.0], [0.011, 1.5, 3.0]]
    assert "git clone https://github.com/ryanGT/systemid" in capsys.readouterr().out


@pytest.mark.parametrize("name", public.SOURCES)
def test_every_recording_has_its_description_and_case(name):
    cases = yaml.safe_load((FOLDER / "cases.yaml").read_text())
    assert cases[name]["recordings"] == [f"public/{name}.csv.gz"]
    columns = set(public.SOURCES[name].columns)
    machine = yaml.safe_load((FOLDER / cases[name]["machine"]).read_text())
    asked = {one["column"] for kind in ("drives", "sensors") for one in machine[kind].values()}
    assert asked <= columns
