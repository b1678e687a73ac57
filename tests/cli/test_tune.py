"""`rtctl tune`: two files and the reasons, or an error message."""

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from rtctl.cli import common, tune
from rtctl.config.errors import NoAnswer, UserError

runner = CliRunner()


def run(*words: str, folder: Path) -> str:
    result = runner.invoke(tune.app, [*words, "--out", str(folder / "tuned.yaml")], catch_exceptions=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.stdout


def test_axis_is_tuned_and_written(tmp_path):
    out = run("axis", "--bandwidth", "4", folder=tmp_path)
    assert "before" in out and "law.position.gain" in out
    assert (tmp_path / "tuned.png").stat().st_size > 20_000
    config = common.load_config(str(tmp_path / "tuned.yaml"), None)
    assert config.law.position.kind == "pd"
    assert "# w_n^2 / K_p for 4 Hz" in (tmp_path / "tuned.yaml").read_text()


def test_json_has_margins_and_reasons(tmp_path):
    found = json.loads(run("axis", "--bandwidth", "4", "--json", folder=tmp_path))
    assert found["after"]["stable"] is True
    assert {reason["path"] for reason in found["reasons"]} == {"law.position.gain", "law.position.tau_d"}


def test_existing_files_are_not_overwritten(tmp_path):
    (tmp_path / "tuned.yaml").write_text("mine")
    with pytest.raises(UserError, match=r"tuned\.yaml: exists; give another name, or --force"):
        run("axis", folder=tmp_path)
    assert (tmp_path / "tuned.yaml").read_text() == "mine"
    run("axis", "--force", folder=tmp_path)
    assert "machine: axis" in (tmp_path / "tuned.yaml").read_text()


@pytest.mark.parametrize(("words", "match"), [
    (["axis", "--plot", "x.pdf"], "the picture is a PNG"),
    (["axis", "--plot", "nowhere/x.png"], "the folder nowhere does not exist"),
    (["axis", "--bandwidth", "5000"], "a tenth of the rate"),
    (["axis", "--set", "law.position.gian=1"], "gain"),
])  # fmt: skip
def test_invalid_arguments_are_refused(words, match, tmp_path):
    with pytest.raises(UserError, match=match):
        run(*words, folder=tmp_path)
    assert not list(tmp_path.iterdir())


def test_unstable_start_writes_no_file(tmp_path):
    with pytest.raises(NoAnswer, match="unstable"):
        run("ivu", "--set", "law.position.gain=120", folder=tmp_path)
    assert not list(tmp_path.iterdir())


def test_help_has_examples():
    command = typer.main.get_command(tune.app)
    assert "rtctl tune ivu" in (command.help or "")
