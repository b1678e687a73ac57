"""`rtctl simulate`: models against recordings."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from known_records import at_rest, of_closed

from rtctl import api
from rtctl.case.format1 import read_case
from rtctl.diagnose.answer.format1_config import write_model
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.record.format1 import load_record
from rtctl.own import files
from rtctl.own import model as own_model
from rtctl.plants.physics import TERMS
from rtctl.trace.bundle import save_case

ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared"
CASE = {
    "format": 1,
    "plant": "axis",
    "sample_rate": 1000.0,
    "parameters": {"M": 95.0, "F_v": 200.0, "F_c": 20.0},
    "sensors": {"x_resolution_m": 5e-8},
    "drive": {"newton_per_volt": 35.0, "limit_volt": 10.0},
    "delay_samples": 0.0,
    "controller": {"kind": "cascade_p_v", "kp": 160.0, "kv": 243.0},
    "controller_known": True,
    "reaches": {"parameter_tolerance": 0.15},
}
SPRING = TERMS["load.spring"].settings(term="load.spring", node="carriage", k=800.0)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    """Bundle of a machine with a spring that the nominal model lacks."""
    folder = tmp_path_factory.mktemp("bundle")
    case, n = read_case(CASE, folder), 4000
    ref = 0.1 * (1 - np.cos(2 * np.pi * np.arange(n) * 1e-3))
    made = of_closed(at_rest(case, n, ref), owner_model(case).add(SPRING))
    columns = {"t": made.t, "ref": ref, "w": made.w, "u": made.u[:, 0], "x": made.y["x"]}
    pq.write_table(pa.table(columns), folder / "recording.parquet")
    save_case(folder, CASE)
    return folder


@pytest.fixture(scope="module")
def model(bundle, tmp_path_factory):
    record = load_record(bundle)
    return write_model(owner_model(record.case).add(SPRING), record, tmp_path_factory.mktemp("model") / "model.yaml")


def test_rotary_axis_is_reported_in_radians_and_newton_metres(rtctl, tmp_path):
    t = np.arange(2500) * 1e-3
    u, x = 0.1 * np.sin(2 * np.pi * t), 1 - np.cos(2 * np.pi * t)
    for name, gain in (("a", 1.0), ("b", 1.1)):
        rows = np.column_stack([t, u, gain * x, np.where(t < 1.0, 0.0, 0.5)])
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header="t,u,x,ref", comments="")
        units = [word for pair in ("u=Nm", "x=rad", "ref=rad") for word in ("--unit", pair)]
        values = ["--parameter", "M=0.02 kg*m^2", "--parameter", "F_v=1 mN*m*s/rad"]
        file = tmp_path / f"{name}.csv"
        made = rtctl("import", file, "--out", tmp_path / name, "--plant", "axis", "--rate", "1kHz", *units, *values)
        assert made.code == 0 and "u [Nm], x [rad]" in made.out
    found = json.loads(rtctl("simulate", "case", tmp_path / "a", "--json").out)
    assert found["unit"] == {"x": "rad"}
    assert " rad " in rtctl("simulate", "case", tmp_path / "a").out
    lines = rtctl("trace", "compare", tmp_path / "a", tmp_path / "b").out
    assert "final error [rad]" in lines and "x [rad]" in lines and "[mm]" not in lines


def test_complete_model_reproduces_the_recording(rtctl, bundle, model):
    code, out, err = rtctl("simulate", model, bundle, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found.keys() == {"rmse", "nrmse", "unit", "skipped"}
    assert found["rmse"].keys() == found["nrmse"].keys() == found["unit"].keys() == {"x", "u"}
    assert found["unit"] == {"x": "m", "u": "V"}
    assert found["skipped"] == 0
    assert max(found["nrmse"].values()) < 1e-6


def test_nominal_model_has_a_larger_rmse_than_the_fitted_model(rtctl, bundle, model):
    fitted, believed = (
        json.loads(rtctl("simulate", name, bundle, "--open-loop", "--json").out)["rmse"] for name in (model, "case")
    )
    assert fitted.keys() == {"x"}
    assert fitted["x"] < 1e-6 < 1e-3 < believed["x"]


def test_simulate_prints_a_table(rtctl, bundle, model):
    code, out, err = rtctl("simulate", model, bundle, "--closed-loop", "--skip", "20")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "closed loop, 3980 rows, the first 20 skipped"
    assert lines[1].split() == ["rmse", "nrmse"]
    assert [line.split()[0] for line in lines[2:]] == ["x", "u"]
    assert lines[2].split()[2] == "m"


def test_plain_config_is_a_model(rtctl, bundle):
    code, out, _ = rtctl("simulate", "axis", bundle, "--json", "--skip", "20")
    assert code == 0
    assert json.loads(out)["skipped"] == 20


def test_simulate_writes_a_picture(rtctl, bundle, model, tmp_path):
    code, _, err = rtctl("simulate", model, bundle, "--plot", tmp_path / "p.png")
    assert (code, err) == (0, "")
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    code, _, err = rtctl("simulate", model, bundle, "--plot", tmp_path / "no" / "p.png")
    assert (code, "cannot be written" in err) == (2, True)


def test_diverging_model_is_reported(rtctl, bundle, model, tmp_path):
    data = yaml.safe_load(model.read_text())
    data["plant"]["physics"] = [{"term": "load.spring", "node": "carriage", "k": -1e6}]
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(data))
    code, out, err = rtctl("simulate", tmp_path / "m.yaml", bundle, "--open-loop")
    assert (code, out) == (3, "")
    assert "the model diverged at tick" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nix", "{bundle}"], "no such file"),
        (["ivu", "{bundle}"], "machine is ivu, and the bundle was recorded on the axis"),
        (["case", "{bundle}/nix"], "is not a folder"),
        (["case", "{bundle}", "--skip", "4000"], "--skip 4000: the recording has 4000 rows"),
        (["case", "{bundle}", "--skip", "-1"], "--skip"),
        (["case"], "missing argument 'BUNDLE'"),
    ],
)
def test_invalid_arguments_are_refused(rtctl, bundle, words, message):
    code, out, err = rtctl("simulate", *(word.format(bundle=bundle) for word in words))
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1


@pytest.fixture
def changed(bundle, tmp_path):
    """`changed(**keys)`: the bundle with a changed case."""

    def make(**keys):
        (tmp_path / "recording.parquet").write_bytes((bundle / "recording.parquet").read_bytes())
        save_case(tmp_path, {**CASE, **keys})
        return tmp_path

    return make


def test_unknown_law_is_an_error(rtctl, changed):
    folder = changed(controller={"kind": "unknown"}, controller_known=False)
    code, _, err = rtctl("simulate", "case", folder, "--closed-loop")
    assert code == 2
    assert "the loop cannot be closed" in err
    code, out, _ = rtctl("simulate", "case", folder)
    assert code == 0
    assert out.startswith("open loop, 4000 rows")


def test_nominal_model_without_a_mass_is_an_error(rtctl, changed):
    code, _, err = rtctl("simulate", "case", changed(parameters={}))
    assert code == 2
    assert "parameters.M is missing" in err


def test_real_axis_is_simulated(rtctl):
    folder = SHARED / "data" / "emps"
    if not folder.is_dir():
        pytest.skip("needs the recordings in ../shared")
    found = json.loads(rtctl("simulate", "axis", folder, "--skip", "20", "--json").out)
    assert found["skipped"] == 20
    assert found["rmse"]["x"] < 1e-4
    assert 0 < found["nrmse"]["u"] < 0.2


def test_user_law_closes_the_loop_if_its_file_is_given(rtctl, tmp_path, monkeypatch):
    (tmp_path / "my_law.py").write_text((ROOT / "rtctl/own/templates/my_law.py").read_text())
    settings = yaml.safe_load((ROOT / "configs/axis.yaml").read_text())
    settings["law"]["position"] = {"kind": "./my_law.py:MyLaw", "gain": 8000.0, "tau_d": 0.02}
    settings["reference"] = {"steps": [{"at": 0.2, "to": 0.02, "ramp": 0.2}]}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(settings))
    changes = {"loop.mode": "fused", "name": f"own-{os.getpid()}"}
    api.record(api.load_config(tmp_path / "own.yaml", changes), 2.2, tmp_path / "run")
    monkeypatch.setattr(files, "_trusted", set())
    own_model._model.cache_clear()
    own_model._law.cache_clear()
    code, out, err = rtctl("simulate", "case", tmp_path / "run")
    assert code == 0 and out.startswith("open loop")
    assert (
        "position law of an own file, ./my_law.py:MyLaw" in err and "the recorded command is taken as the input" in err
    )
    code, out, err = rtctl("simulate", "case", tmp_path / "run", "--own", tmp_path / "my_law.py")
    assert code == 0 and "is taken as the input" not in err
    assert re.match(r"closed loop, .*\n.*\nx +0 m +0\nu +0 V +0\n", out)


def test_described_machine_is_simulated(rtctl, tmp_path):
    """A rotor with the inertia of its description, and a rotor with twice the inertia."""
    t = np.arange(2000) * 1e-3
    u = np.sin(2 * np.pi * t)
    x = np.concatenate(
        [[0.0], np.cumsum(1e-3 * np.cumsum(1e-3 * u / 0.01))[:-1]]
    )  # zero-order hold: a command acts one tick later
    machine = {
        "bodies": {"rotor": {"inertia": 0.01}},
        "drives": {"motor": {"body": "rotor", "column": "u", "kind": "force", "gain": 1.0}},
        "sensors": {"encoder": {"body": "rotor", "measures": "position", "column": "x", "counts_per_unit": 1e5}},
    }
    case = {"format": 2, "sample_rate": 1000.0, "machine": machine, "delay_samples": 0.0}
    pq.write_table(pa.table({"t": t, "u": u, "x": np.floor(1e5 * x)}), tmp_path / "recording.parquet")
    save_case(tmp_path, case)
    heavy = {**machine, "bodies": {"rotor": {"inertia": 0.02}}}
    (tmp_path / "heavy.yaml").write_text(yaml.safe_dump({"machine": heavy}))
    found = []
    for model in ("case", tmp_path / "heavy.yaml"):
        code, out, _ = rtctl("simulate", model, tmp_path, "--json")
        assert code == 0
        found.append(json.loads(out))
    assert found[0]["unit"] == {"encoder": "rad"} and found[0]["skipped"] == 0
    assert found[0]["nrmse"]["encoder"] < 0.01 < 0.1 < found[1]["nrmse"]["encoder"]
    code, _, err = rtctl("simulate", "case", tmp_path, "--closed-loop")
    assert code == 2 and "law is not known" in err
