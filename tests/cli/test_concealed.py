"""Hidden effect end to end: plant and loop in two processes, diagnosis of the capture, simulation of the model,
opened seal."""

import os
import signal

import numpy as np
import pytest
from narrowed import only

from rtctl.diagnose.answer import answer, files
from rtctl.diagnose.answer.format1_config import read_model
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record.format1 import load_record
from rtctl.diagnose.seal import open_seal

AMONG = (  # the full library takes a minute on the LDU
    "friction.stribeck", "friction.coulomb", "friction.viscous", "drive.offset", "drive.deadband", "load.spring",
    "transmission.backlash", "ripple.capstan", "drive.gain_asymmetry",
)  # fmt: skip


@pytest.mark.long
def test_diagnosis_of_a_capture_names_the_hidden_effect_of_the_plant(started, runtime, tmp_path, monkeypatch):
    """Reel unit only; `rtctl prove` covers all machines."""
    machine, seed, reference, seconds = "ivu", 2, "steps", 13
    name, seal, folder = f"{machine}{os.getpid()}", tmp_path / "seal.json", tmp_path / "bundle"
    endpoint = f"ipc://{runtime}/{name}.plant"
    hide = ["--endpoint", endpoint, "--mode", "lockstep", "--conceal", str(seed), "--seal", str(seal)]
    changes = [f"name={name}", f"link.endpoint={endpoint}", "link.plant=external", "link.timeout=60"]
    run = ["run", machine, "--mode", "lockstep", "--reference", reference, "--for", f"{seconds}s", "--no-plot"]
    with started("plant", machine, "--set", f"name={name}", *hide) as plant:
        plant.stdout.readline()
        with started(*run, "--out", str(folder), *(w for c in changes for w in ("--set", c))) as loop:
            _, err = loop.communicate(timeout=300)
        assert loop.returncode == 0, err
        if plant.poll() is None:
            plant.send_signal(signal.SIGINT)
        plant.communicate(timeout=30)
    record = load_record(folder)
    assert 1 / record.dt == 500
    only(monkeypatch, *AMONG)
    told = answer.diagnose(folder)
    (entry,) = open_seal(seal)[0]["physics"]
    assert (told.verdict, [e.name for e in told.effects]) == ("named", [entry["term"]])
    path = files.write_model(told, tmp_path / "model.yaml")
    models = (owner_model(record.case, record), read_model(path, record))
    before, after = (_tracked(graph_record(record, model)) for model in models)
    assert after < 0.6 * before


def _tracked(record):
    """Rms residual of the main sensor under the tracking observer, last three quarters of the record."""
    sim = Simulator(record)
    late = slice(len(record.t) // 4, None)
    return np.sqrt(np.mean((sim.run(nominal(record.case))[late, sim.column(sim.main)] - sim.seen[late]) ** 2))
