"""`rtctl improve`: an improved config and a report, or an error message."""

import json

import pytest
from typer.testing import CliRunner

from rtctl.cli import common, improve
from rtctl.config.errors import UserError
from rtctl.config.load import to_yaml

runner = CliRunner()
DRY = {"term": "friction.coulomb", "node": "carriage", "F_C": 3.0}


def run(*words):
    result = runner.invoke(improve.app, [*map(str, words)], catch_exceptions=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.stdout


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "model.yaml"
    path.write_text(to_yaml(common.load_config("configs/machines/belt.yaml", ["plant.physics=[]"])))
    return path


def test_improve_writes_a_better_config_and_a_report(model, tmp_path):
    config = common.load_config(str(model), [])
    from rtctl.config.load import set_paths

    model.write_text(to_yaml(set_paths(config, {"plant.physics": [DRY]})))
    out = tmp_path / "better.yaml"
    found = json.loads(run(model, "--out", out, "--json"))
    assert found["reduction"] > 0.8 and found["after"]["rms"] < found["before"]["rms"]
    assert {"description", "feedforward"} <= {one["remedy"] for one in found["kept"]}
    assert found["given_up"] and all(one["reason"] for one in found["left_out"])
    better = common.load_config(str(out), [])
    assert better.loop.mode == config.loop.mode
    assert better.law.compensation.feedforward.effects[0].effect.F_C == 3.0
    assert out.read_text().startswith("# belt, improved by `rtctl improve`")
    page = (tmp_path / "better.html").read_text()
    assert "falls by" in page and "<svg" in page and "What was given up" in page and "http" not in page


@pytest.mark.parametrize(("words", "match"), [
    (["--learn", "3"], "--learn: goes with --closed-loop"),
    (["--out", "better.txt"], "a config is YAML"),
    (["--config", "ivu"], "is of another kind of machine"),
    (["--reference", "nowhere.yaml"], "nowhere"),
])  # fmt: skip
def test_invalid_arguments_are_refused(words, match, model, tmp_path):
    with pytest.raises(UserError, match=match):
        run(model, *words)
    assert not list(tmp_path.glob("better*"))


def test_existing_files_are_not_overwritten(model, tmp_path):
    (tmp_path / "better.yaml").write_text("mine")
    with pytest.raises(UserError, match="exists; give another name, or --force"):
        run(model, "--out", tmp_path / "better.yaml")
    assert (tmp_path / "better.yaml").read_text() == "mine"


def test_unknown_body_is_refused(model, tmp_path):
    with pytest.raises(UserError, match="--body arm: the machine has motor, carriage"):
        run(model, "--body", "arm", "--out", tmp_path / "better.yaml")
