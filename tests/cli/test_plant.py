"""The emulator as a separate process, and a loop that drives the emulator over TCP."""

import json
import os
import signal
import socket

import pytest

from rtctl.diagnose.seal import close_seal, open_seal
from rtctl.plants.physics import TERMS
from rtctl.trace.bundle import load_bundle

LOOP = [
    "link.plant=external",
    "loop.realtime=off",
    "safety.link_timeout=10",
    "safety.missed_ticks=0",
    "link.timeout=20",
]


@pytest.fixture
def endpoint(runtime):
    """Endpoint on a free loopback port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


def test_loop_drives_an_external_plant(rtctl, started, endpoint, tmp_path):
    name = f"plant{os.getpid()}"
    changes = [word for key in (f"name={name}", f"link.endpoint={endpoint}", *LOOP) for word in ("--set", key)]
    with started("plant", "ivu", "--endpoint", endpoint, "--set", f"name={name}") as plant:
        assert plant.stdout.readline() == f"{name}: plant listens at {endpoint}\n"
        code, _, err = rtctl("plant", "ivu", "--endpoint", endpoint)
        assert code == 2
        assert f"{endpoint} is in use" in err
        words = ["--mode", "real", "--for", "1s", "--json", "--no-plot", "--out", str(tmp_path / "bundle")]
        with started("run", "ivu", *words, *changes) as loop:
            out, err = loop.communicate(timeout=200)
        assert loop.returncode == 0, err
        told = json.loads(out)
        assert (told["ticks"], told["trip"], told["link"]) == (500, None, "zmq")
        assert told["frames"]["received"] > 0
        plant.send_signal(signal.SIGINT)
        assert plant.wait(30) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ivu", "--mode", "fused"], "plant inside"),
        (["ivu", "--endpoint", "tcp://0.0.0.0:5570"], "needs keys"),
        (["nix"], "no such file"),
        (["ivu", "--set", "plant.set=identifed"], "did you mean 'identified'"),
        ([], "missing argument 'CONFIG'; see rtctl plant --help"),
        (["ivu", "--conceal", "3"], "--conceal SEED and --seal FILE go together"),
        (["ivu", "--seal", "x.json"], "--conceal SEED and --seal FILE go together"),
        (["ivu", "--conceal", "-3", "--seal", "x.json"], "--conceal"),
        (["ivu", "--conceal", "3", "--seal", "/no/such/x.json"], "cannot be written"),
        (["--open-seal", "/no/such/x.json"], "is missing"),
    ],
)
def test_invalid_plant_is_refused(rtctl, runtime, words, message):
    code, out, err = rtctl("plant", *words)
    assert (code, out) == (2, "")
    assert message in err


def test_hidden_effect_is_in_the_plant_and_the_seal_only(rtctl, started, runtime, tmp_path):
    """Two processes in lockstep: only the plant and the seal contain the effect."""
    name, seal, folder = f"hidden{os.getpid()}", tmp_path / "seal.json", tmp_path / "bundle"
    endpoint = f"ipc://{runtime}/{name}.plant"
    words = ["--endpoint", endpoint, "--mode", "lockstep", "--conceal", "4", "--seal", str(seal)]
    steps = "reference.steps=[{at: 0.1 s, to: 50 mm, ramp: 100 mm/s}, {at: 1 s, to: 0 mm, ramp: 100 mm/s}]"
    changes = [f"name={name}", f"link.endpoint={endpoint}", "link.plant=external", "link.timeout=60", steps]
    run = ["run", "axis", "--mode", "lockstep", "--for", "2s", "--json", "--no-plot", "--out", str(folder)]
    with started("plant", "axis", "--set", f"name={name}", *words) as plant:
        heard = plant.stdout.readline()
        assert heard == f"{name}: plant listens at {endpoint}\n"
        with started(*run, *(word for change in changes for word in ("--set", change))) as loop:
            out, err = loop.communicate(timeout=200)
        assert loop.returncode == 0, err
        if plant.poll() is None:
            plant.send_signal(signal.SIGINT)
        heard_too, plant_err = plant.communicate(timeout=30)
    answer, digest = open_seal(seal)
    (entry,) = answer["physics"]
    assert entry["term"] in TERMS
    told = out + err + heard + heard_too + plant_err
    assert f"sha256 {digest}" in plant_err
    case = (folder / "case.json").read_text()
    assert entry["term"] not in told
    assert entry["term"] not in case
    bundle = load_bundle(folder)
    assert len(bundle.columns["t"]) == 2000
    assert bundle.case["config"]["plant"].get("physics", []) == []
    code, out, _ = rtctl("plant", "--open-seal", seal)
    assert code == 0
    assert out.startswith(f"{name} (axis), seed 4, sha256 {digest}: as it was sealed\n- {{term: {entry['term']}, ")


def test_changed_seal_is_detected(rtctl, tmp_path):
    seal = tmp_path / "seal.json"
    close_seal(seal, {"name": "ivu", "plant": "ivu", "seed": 1, "physics": []})
    assert rtctl("plant", "--open-seal", seal).code == 0
    content = json.loads(seal.read_text())
    seal.write_text(json.dumps({**content, "salt": content["salt"][::-1]}))
    code, out, err = rtctl("plant", "--open-seal", seal)
    assert (code, out) == (2, "")
    assert "is not what was sealed" in err
