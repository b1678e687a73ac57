"""Law of recordings of the program: recomputed, and replayed after a disagreement."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from rtctl import api
from rtctl.diagnose.record.format1 import load_record
from rtctl.diagnose.record.replayed import replayed_law
from rtctl.trace.bundle import load_bundle

ROWS = 1500


@pytest.fixture(scope="module")
def ran(config, tmp_path_factory) -> Path:
    """Recording of 3 s of the reel unit with its full law: friction and inertia feedforward, tension ramp."""
    folder = tmp_path_factory.mktemp("own") / "run"
    moves = {"reference": {"steps": [{"at": 0.2, "to": 1.5, "ramp": 3.0}, {"at": 1.6, "to": 0.0, "ramp": 3.0}]}}
    api.record(config("ivu", mode="fused", set=moves), 3.0, folder)
    return folder


@pytest.fixture
def copy(ran, tmp_path) -> Iterator[Path]:
    """A copy to modify, removed before the suite replays its recordings."""
    yield Path(shutil.copytree(ran, tmp_path / "copy"))
    shutil.rmtree(tmp_path / "copy")


def law_words(folder: Path) -> str:
    """Warning about the law."""
    return next(w for w in load_record(folder).case.warnings if "the law" in w)


def test_command_that_differs_from_the_law_is_reported_with_its_tick(copy):
    path = copy / "recording.parquet"
    table = pq.read_table(path)
    values = table.column("u1").to_numpy().copy()
    values[700:] += 0.25
    at = table.column_names.index("u1")
    pq.write_table(table.set_column(at, table.schema.field(at), pa.array(values)), path)
    said = law_words(copy)
    assert "does not give the recorded command: u1 differs from tick 700 (1.4 s) on, by up to 0.25 V" in said
    assert "nothing is wrong" not in said


def test_code_in_a_recording_is_not_executed(copy, tmp_path):
    case = json.loads((copy / "case.json").read_text())
    case["config"]["law"]["position"] = {"kind": "./my_law.py:MyLaw"}
    case["config"]["own"] = {"./my_law.py": f"open({str(tmp_path / 'ran')!r}, 'w').close()\n"}
    (copy / "case.json").write_text(json.dumps(case))
    assert "was not replayed" in law_words(copy) and not (tmp_path / "ran").exists()


@pytest.mark.parametrize("column", ["tick", "order"])
def test_foreign_recording_is_not_replayed(copy, column):
    bundle = load_bundle(copy)
    del bundle.columns[column]
    assert replayed_law(bundle) is None
    assert replayed_law(replace(bundle, case={**bundle.case, "config": None})) is None
