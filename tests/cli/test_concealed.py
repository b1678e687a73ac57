"""From a machine with something hidden in it to the opened seal: plant and loop as two processes, the capture
diagnosed, the model run against it."""

import os
import signal

import numpy as np
from narrowed import only

from rtctl.diagnose.answer import answer, files
from rtctl.diagnose.answer.format1_config import read_model
from rtctl.diagnose.model.by_symbol import owner_model
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.model.model import nominal
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.record.format1 import load_record
from rtctl.diagnose.seal import open_seal

AMONG = (  # the library in full takes a minute on the LDU
    "friction.stribeck", "friction.coulomb", "friction.viscous", "drive.offset", "drive.deadband", "load.spring",
    "transmission.backlash", "ripple.capstan", "drive.gain_asymmetry",
)  # fmt: skip


def test_what_a_plant_conceals_is_named_by_a_diagnosis_of_its_capture(started, runtime, tmp_path, monkeypatch):
    """On the reel unit; `rtctl prove` does it on all machines."""
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
    """Rms of what the observer leaves of the main sensor's error in the last three quarters."""
    sim = Simulator(record)
    late = slice(len(record.t) // 4, None)
    return np.sqrt(np.mean((sim.run(nominal(record.case))[late, sim.column(sim.main)] - sim.seen[late]) ** 2))
