"""`rtctl diagnose` on one bundle, on several bundles and on a machine."""

import json
import os
import shutil
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from known_records import at_rest, closed
from narrowed import only
from rich.console import Console

from rtctl.case.format1 import read_case
from rtctl.cli import diagnose_console
from rtctl.cli.main import main
from rtctl.diagnose.folder import Outcome
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.plants.physics import TERMS
from rtctl.trace.bundle import save_case

STEP = 1e-6  # m, of the encoder
CASE = {
    "format": 1,
    "plant": "axis",
    "sample_rate": 1000.0,
    "parameters": {"M": 95.0, "F_v": 200.0, "F_c": 20.0},
    "sensors": {"x_resolution_m": STEP},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "delay_samples": 0.0,
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
    "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15},
}
SPRING = TERMS["load.spring"].settings(term="load.spring", node="carriage", k=600.0)


def record_into(folder, n=5000):
    """A bundle of an axis with a spring that the nominal model lacks."""
    folder.mkdir(parents=True)
    case = read_case(CASE, folder)
    t, zero = np.arange(n) * 1e-3, np.zeros(n)
    ref = 0.05 * (1 - np.cos(2 * np.pi * 0.4 * t)) + 0.01 * np.sin(2 * np.pi * 1.3 * t)
    y, volts = closed(at_rest(case, n, ref), owner_model(case).add(SPRING))
    x = np.round(y["x"] / STEP) * STEP
    pq.write_table(pa.table({"t": t, "ref": ref, "w": zero, "u": volts[:, 0], "x": x}), folder / "recording.parquet")
    save_case(folder, {**CASE, "controller_known": False})
    return folder


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    """Bundle with the files of one diagnosis."""
    folder = record_into(tmp_path_factory.mktemp("many") / "axis")
    with pytest.MonkeyPatch.context() as patch:
        only(patch, "load.spring", "structure.stiffening", "drive.offset", "friction.coulomb")
        assert main(["diagnose", str(folder)]) == 0
    return folder


def test_diagnose_writes_result_model_and_report(bundle):
    found = json.loads((bundle / "diagnosis" / "diagnosis.json").read_text())
    assert "load.spring" in {e["name"] for e in found["effects"]}
    assert found["verdict"] in ("named", "ambiguous")
    model = yaml.safe_load((bundle / "diagnosis" / "model.yaml").read_text())
    assert "load.spring" in {entry["term"] for entry in model["plant"]["physics"]}
    page = (bundle / "diagnosis" / "report.html").read_text()
    assert "<html" in page and "src=" not in page


def test_diagnosed_model_has_a_lower_nrmse_than_the_nominal_model(rtctl, bundle):
    nrmse = [
        json.loads(rtctl("simulate", model, bundle, "--json").out)["nrmse"]["x"]
        for model in (bundle / "diagnosis" / "model.yaml", "case")
    ]
    assert nrmse[0] < 0.2 * nrmse[1]


def test_json_is_the_only_standard_output(rtctl, bundle, tmp_path, monkeypatch):
    only(monkeypatch, "load.spring")
    code, out, _ = rtctl("diagnose", bundle, "--json", "--no-report", "--out", tmp_path)
    found = json.loads(out)
    assert code == 0
    written = json.loads((tmp_path / "diagnosis.json").read_text())
    assert {**found, "seconds": 0} == {**written, "seconds": 0}
    assert {p.name for p in tmp_path.iterdir()} == {"diagnosis.json", "model.yaml"}


def test_diagnosis_of_several_bundles_continues_after_a_broken_one(rtctl, bundle, tmp_path):
    many = bundle.parent
    folder = tmp_path / "many"
    shutil.copytree(many, folder)
    for name in ("empty", "short", "typo"):
        (folder / name).mkdir()
        save_case(folder / name, CASE if name != "typo" else {**CASE, "plant": "axi"})
    table = pq.read_table(bundle / "recording.parquet")
    pq.write_table(table.slice(0, 400), folder / "short" / "recording.parquet")
    pq.write_table(table, folder / "typo" / "recording.parquet")
    code, out, _ = rtctl("diagnose", folder, "--jobs", "2")
    assert code == 2
    lines = {line.split()[0]: line for line in out.splitlines() if line}
    assert "load.spring at carriage" in lines["axis"] and "done before" in lines["axis"]
    assert "is missing" in lines["empty"]
    assert "supports no verdict" in lines["short"] and "400 rows" in lines["short"]
    assert "is it 'axis'?" in lines["typo"]
    code, out, _ = rtctl("diagnose", folder, "--json")
    found = json.loads(out)["bundles"]
    assert code == 2 and found.keys() == {"axis", "empty", "short", "typo"}
    assert found["axis"]["skipped"] and found["short"]["exit_code"] == 3


def test_bundle_without_a_verdict_is_exit_code_3(rtctl, bundle, tmp_path):
    (tmp_path / "a").mkdir()
    save_case(tmp_path / "a", CASE)
    pq.write_table(pq.read_table(bundle / "recording.parquet").slice(0, 400), tmp_path / "a" / "recording.parquet")
    assert rtctl("diagnose", tmp_path).code == 3
    said = rtctl("diagnose", tmp_path / "a")
    assert said.code == 3 and "400 rows" in said.err and said.out == ""


@pytest.mark.parametrize(
    "words, message",
    [
        (["nowhere"], "nowhere is not a folder"),
        (["x", "--for", "3s"], "--for goes with --closed-loop"),
        (["axis", "--closed-loop", "--heldout", "x"], "--heldout goes with a BUNDLE"),
        (["axis", "--closed-loop", "--for", "long"], "not a duration"),
        (["axis", "--closed-loop", "--set", "link.plant=external"], "--reference"),
        (["nomachine", "--closed-loop"], "nomachine"),
    ],
)
def test_invalid_arguments_are_exit_code_2(rtctl, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = rtctl("diagnose", *words)
    assert code == 2 and message in err and out == ""


def test_closed_loop_diagnosis_records_and_prints_its_changes(rtctl, tmp_path, monkeypatch):
    """Output of the closed-loop diagnosis; `repair` is replaced by a stub."""
    from rtctl.diagnose.answer import files, repair

    seen = {}

    def recorded(config, out, length, progress, **more):
        seen.update(mode=config.loop.mode, steps=len(config.reference.steps), out=out, length=length)
        progress("recording 3 s")
        d = SimpleNamespace(record=SimpleNamespace(case=SimpleNamespace(warnings=("mind this",))), verdict="nothing")
        return repair.Repair((out / "recording",), (d,), ("",))

    monkeypatch.setattr(repair, "repair", recorded)
    monkeypatch.setattr(files, "changes", lambda d: [("plant.physics.0", "-", "load.spring at carriage")])
    monkeypatch.setattr(files, "write", lambda *_: ["no report"])
    monkeypatch.setattr(diagnose_console.DiagnoseConsole, "result", lambda *_: None)
    code, out, err = rtctl("diagnose", "--closed-loop", "axis", "--for", "3s", "--out", tmp_path)
    assert code == 0
    assert seen == {"mode": "fused", "steps": len(repair.LEGS), "out": tmp_path, "length": 3.0}
    assert "load.spring at carriage" in out and f"{tmp_path / 'recording'}" in out.replace("\n", "")
    assert "recording 3 s" in err and "note: mind this" in err and "note: no report" in err


def test_diagnose_has_a_help_text(rtctl):
    code, out, _ = rtctl("diagnose", "--help")
    assert code == 0 and "--closed-loop" in out
    assert rtctl("prove", "--help").code == 0


def test_progress_bar_restarts_with_each_recording():
    said = ["recording 25 s", "preflight", "fitting the nominal parameters", "screening 60 hypotheses",
            "fitting a:b", "screening 3 hypotheses beside a:b", "fitting a:b + c:d", "look-alikes of a:b",
            "predicting the held-out rows", "writing the results"]  # fmt: skip
    done = [0.0]
    for text in said:
        done.append(diagnose_console.onward(done[-1], text))
    assert all(a < b for a, b in pairwise(done[1:])) and done[-1] < 1.0
    assert diagnose_console.onward(0.8, "recording 25 s") == 0.0


def test_summary_line_of_a_bundle():
    effects = [{"name": "drive.offset", "node": "drive1", "confidence": 0.914}]
    line = diagnose_console.line(Outcome("a", 0, 12.34, {"verdict": "named", "effects": effects}))
    assert line.plain.split() == ["a", "named", "drive.offset", "at", "drive1", "91", "%", "12.3", "s"]
    failed = diagnose_console.line(Outcome("[b]", 1, 1.0, message="its process died (exit code -9)"))
    assert failed.plain.split()[:2] == ["[b]", "failed:"]


def test_stages_are_cleared_from_the_terminal():
    console = diagnose_console.DiagnoseConsole(json=True)
    with Path(os.devnull).open("w") as nowhere:
        console.err = Console(file=nowhere, force_terminal=True)
        with console.stages() as stage:
            stage("preflight")
        with console.many(1) as show:
            show(Outcome("a", 2, 0.1, message="no column 't'"))
