"""Commands on a described machine: new, check, tune, and errors with file and line."""

import pytest
import yaml

from rtctl.cli.common import load_config
from rtctl.own.new_like import examples


@pytest.fixture(autouse=True)
def _runtime(runtime):
    """Runtime folder, since socket names are printed."""


def test_new_machine_can_start_from_every_example(rtctl, tmp_path):
    for like in examples("machine"):
        path = tmp_path / f"my-{like}.yaml"
        code, out, err = rtctl("new", "machine", path.name, "--like", like, "--into", tmp_path)
        assert (code, err) == (0, "") and str(path) in out and "next: rtctl check" in out
        config = load_config(str(path), [])
        assert config.name == f"my-{like}" and config.machine == load_config(f"machines/{like}", []).machine
        assert path.read_text().startswith("# ")


@pytest.mark.parametrize(("words", "message"), [
    (["my.yaml"], "my.yaml: there already"), (["other.yaml", "--like", "blet"], "did you mean 'belt'"),
    (["a b"], "a machine's name is letters"),
])  # fmt: skip
def test_new_machine_refuses_existing_files_and_invalid_names(rtctl, tmp_path, words, message):
    (tmp_path / "my.yaml").write_text("")
    code, out, err = rtctl("new", "machine", *words, "--into", tmp_path)
    assert (code, out) == (2, "") and message in err
    assert (tmp_path / "my.yaml").read_text() == ""


def test_check_prints_modes_and_draws_the_machine(rtctl, tmp_path):
    code, out, err = rtctl("check", "belt", "--svg", tmp_path / "belt.svg")
    assert (code, err) == (0, "") and out.startswith("ok\n")
    for words in ("belt (described)", "130.4 Hz, damping 0.18", "8 of 9 parameters", "only together: motor.inertia"):
        assert words in out
    assert (tmp_path / "belt.svg").read_text().endswith("</svg>\n")
    assert rtctl("check", "ivu", "--svg", tmp_path / "ivu.svg")[0] == 2


def test_tune_writes_a_law_that_loads(rtctl, tmp_path):
    data = yaml.safe_load((load_path("belt")).read_text())
    del data["law"]["position"]
    (tmp_path / "bare.yaml").write_text(yaml.safe_dump(data))
    code, out, _ = rtctl("tune", tmp_path / "bare.yaml", "-o", tmp_path / "tuned.yaml")
    assert code == 0 and "before   no law that moves the machine" in out and "PD: encoder shows a position" in out
    made = load_config(str(tmp_path / "tuned.yaml"), [])
    assert made.law.position.gain > 0 and made.machine == load_config("belt", []).machine
    code, _, err = rtctl("tune", "belt", "-o", tmp_path / "no.yaml", "--gm", "40", "--pm", "89")
    assert code == 3 and "no PD law from encoder to amplifier is stable with 40 dB" in err


@pytest.mark.parametrize(("key", "message"), [
    ("machine.joints.belt.from=motr", "there is no body 'motr'; did you mean 'motor'"),
    ("machine.drives.amplifier.body=carrige", "there is no body 'carrige'"),
    ("machine.sensors.scale.measures=force", "force is not seen at a body"),
    ("machine.drives.amplifier.kind=voltage", "'30 mNm/V' is not a quantity in"),
    ("machine.bodies.carriage.gravity={mass: 1, arm: 1}", "this body slides; give incline"),
    ("law.shares={ampifier: 1}", "did you mean 'amplifier'"),
    ("driver.kind=comedi", "'comedi' is not one of emulated"),
    ("plant.kind=./mine.py:Mine", "is its own plant"),
])  # fmt: skip
def test_check_reports_mistakes_in_a_described_machine(rtctl, key, message):
    code, out, err = rtctl("check", "belt", "--set", key)
    assert (code, out) == (2, "") and message in err


def test_described_machine_does_not_support_hidden_effects(rtctl, tmp_path):
    code, _, err = rtctl("plant", "belt", "--conceal", "3", "--seal", tmp_path / "seal.json")
    assert code == 2 and "effects can be hidden only in a shipped machine" in err


def load_path(name):
    from rtctl.config.yaml_file import find

    return find(name)
