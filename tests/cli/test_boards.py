"""Real boards and FMUs on the command line: a run of each, and error messages."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rtctl.cli.common import load_config
from rtctl.loop import fused
from rtctl.trace.bundle import load_bundle

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS / "plants"))
FMU = "plant.fmu={{file: {file}, inputs: {{drive: u}}, outputs: {{sensor: {sensor}}}}}"


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler (cc) here")
    out = tmp_path_factory.mktemp("comedi") / "libcomedi.so"
    source = TESTS / "drivers" / "comedi_card.c"
    subprocess.run([compiler, "-shared", "-fPIC", source, "-o", out, "-lm"], check=True)
    return out


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    import carriage

    folder = tmp_path_factory.mktemp("fmu")
    built = carriage.library(folder)
    if built is None:
        pytest.skip("no C compiler (cc) here")
    return carriage.pack(folder / "carriage.fmu", built)


@pytest.mark.realtime
def test_card_that_fails_during_a_run_is_zeroed_and_reported(running, library, tmp_path, monkeypatch):
    """A file tells the emulated card in the other process to fail."""
    monkeypatch.setenv("CARD_FAILS_IF", str(tmp_path / "broken"))
    name, folder = f"card{os.getpid()}", tmp_path / "bundle"
    with running(name, folder, "--set", f"driver={{kind: comedi, library: {library}}}") as run:
        (tmp_path / "broken").touch()
        heard = ""
        while "its outputs are zero" not in heard:
            line = run.stderr.readline()
            assert line, heard
            heard += line
        told = r"/dev/comedi0 \(at-mio-16de-10\): reading input [01]: Input/output error"  # channel: chance
        assert re.search(told, heard)
        run.send_signal(signal.SIGINT)
        assert run.wait(60) in (0, 130)
    assert load_bundle(folder).columns["u1"].max() == 0.0


def test_fmu_in_lockstep_agrees_with_the_emulator_of_the_same_equations(rtctl, fmu, runtime, tmp_path):
    reference = "reference.steps=[{at: 0.2 s, to: 5 mm}]"
    changes = (f"name=f{os.getpid()}", "plant.parameters.F_c=0", reference, FMU.format(file=fmu, sensor="x"))
    words = ["--mode", "lockstep", "--for", "1s", "--no-plot", "--json", "--out", tmp_path / "bundle"]
    code, _, err = rtctl("run", "axis", *words, *(w for c in changes for w in ("--set", c)))
    assert code == 0, err
    x = load_bundle(tmp_path / "bundle").columns["x"]
    emulated = fused.run(load_config("axis", ["loop.mode=fused", *changes[:3]]), 1.0)["x"]
    assert len(x) == 1000
    assert x.max() > 4e-3
    # the output of the emulator settles for 4 us of each step, that of the FMU at once
    assert np.abs(x - emulated).max() < 1e-2 * emulated.max()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--set", "driver.kind=comedy"], "did you mean 'comedi'"),
        (["--mode", "fused", "--set", "driver.kind=comedi"], "a real board keeps real time"),
        (["--mode", "lockstep", "--set", "driver={kind: comedi, devise: x}"], "driver.devise: unknown key"),
        (["--set", FMU.format(file="missing.fmu", sensor="x")], "runs in lockstep only"),
        (["--mode", "lockstep", "--set", FMU.format(file="missing.fmu", sensor="x")], "there is no such file"),
    ],
)
def test_config_mistake_is_one_message_before_the_run(rtctl, words, message):
    code, _, err = rtctl("check", "axis", *words)
    assert code == 2
    assert message in err


@pytest.mark.parametrize(
    ("config", "plant"),
    [
        ("ivu_comedi", "/dev/comedi0 by comedi"),
        ("ldu_nidaqmx", "Dev1 by nidaqmx"),
        ("axis_odrive", "can0 by can"),
        ("axis_serial", "/dev/ttyACM0 by serial"),
    ],
)
def test_shipped_board_configs_are_valid(rtctl, config, plant):
    code, out, err = rtctl("check", f"boards/{config}")
    assert (code, plant in out) == (0, True), err


@pytest.mark.parametrize(
    ("config", "change", "message"),
    [
        ("axis_odrive", "driver.nodes={moter: {id: 1}}", "driver.nodes.moter: the machine has no such drive"),
        ("axis_odrive", "driver.sensors={}", "driver.sensors.encoder is missing: say which node"),
        ("axis_odrive", "driver.nodes.torque.id=64", "driver.nodes.torque.id"),
        ("axis_odrive", "loop.mode=fused", "a real board keeps real time"),
        ("axis_odrive", "driver={kind: comedi}", "driver.kind"),
        ("axis_serial", "driver.timeout=0 s", "driver.timeout"),
    ],
)
def test_bus_config_mistake_is_one_message_before_the_run(rtctl, config, change, message):
    code, _, err = rtctl("check", f"boards/{config}", "--set", change)
    assert (code, message in err) == (2, True), err


def test_missing_bus_is_an_error(rtctl, runtime):
    for config, words in (("axis_odrive", "driver.interface:"), ("axis_serial", "driver.port: there is no /dev/none")):
        where = "driver.interface=nocan7" if config == "axis_odrive" else "driver.port=/dev/none"
        code, _, err = rtctl("plant", f"boards/{config}", "--set", f"name=b{os.getpid()}", "--set", where)
        assert (code, words in err) == (2, True), err


def test_user_plant_excludes_a_card_and_an_fmu(rtctl, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert rtctl("new", "plant", "my_plant", "--for", "axis").code == 0
    code, out, err = rtctl("check", "my_plant.yaml")
    assert (code, "emulated" in out) == (0, True), err


def test_plant_without_its_card_does_not_start(rtctl, runtime):
    card = "driver={kind: comedi, library: /nothing.so}"
    code, _, err = rtctl("plant", "boards/ivu_comedi", "--set", f"name=p{os.getpid()}", "--set", card)
    assert (code, "is no libcomedi" in err) == (2, True), err


def test_check_validates_the_variables_of_the_fmu(rtctl, fmu):
    code, _, err = rtctl("check", "axis", "--mode", "lockstep", "--set", FMU.format(file=fmu, sensor="X"))
    assert (code, "did you mean 'x'" in err) == (2, True)
    code, out, _ = rtctl("check", "axis", "--mode", "lockstep", "--set", FMU.format(file=fmu, sensor="x"))
    assert code == 0
    assert f"the FMU {fmu}" in out


def test_wiring_check_runs_unattended(rtctl, library, runtime):
    card = f"driver={{kind: comedi, library: {library}}}"
    code, out, err = rtctl("doctor", "--board", "ivu", "--json", "--set", card, "--set", f"name=w{os.getpid()}")
    assert code == 0, err
    told = json.loads(out)
    assert told["card"] == "/dev/comedi0 (at-mio-16de-10)"
    assert {c["name"]: c["verdict"] for c in told["checks"]}["rest"] == "good"
    assert told["bad"] == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--board", "ivu"], "has an emulated board"),
        (["--board", "ivu", "--need", "500"], "--board checks wires"),
        (["--set", "loop.rate=100"], "it needs --board CONFIG"),
        (["--board", "ivu", "--set", "driver={kind: comedi, library: /nothing.so}"], "is no libcomedi"),
    ],
)
def test_wiring_check_refuses_invalid_arguments(rtctl, runtime, words, message):
    code, _, err = rtctl("doctor", *words, *(["--set", "name=nobody"] if "--board" in words else []))
    assert code == 2
    assert message in err
