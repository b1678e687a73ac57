"""`rtctl identify friction | radius | driver | scale | steps` on the command line."""

import json

import pytest
from typer.testing import CliRunner

from rtctl.cli import identify_bench
from rtctl.config.errors import NoAnswer, UserError


def run(*words: str) -> str:
    result = CliRunner().invoke(identify_bench.app, list(words))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def test_identify_radius(tmp_path):
    text = run("radius", "ivu", "--plot", str(tmp_path / "r.png"))
    assert text.count("reel 1") == 2
    assert (tmp_path / "r.png").stat().st_size > 10_000


def test_identify_radius_as_json():
    ways = json.loads(run("radius", "ivu", "--json"))["ways"]
    assert ways[0]["R1"]["R"] == pytest.approx(0.038, rel=0.01)


def test_identify_friction(tmp_path):
    found = json.loads(
        run("friction", "ivu", "--turns", "1", "--speeds", "1,2,4", "--json", "--plot", str(tmp_path / "f.png"))
    )
    assert found["unit"] == "Nm"
    assert found["forward"]["F_C"] == pytest.approx(2.64e-3, rel=0.02)
    assert (tmp_path / "f.png").exists()


def test_identify_driver(tmp_path):
    text = run("driver", "ldu_printer", "--plot", str(tmp_path / "d.png"))
    assert "0.0420 A (0.88 mNm) below 0.80 V" in text
    assert (tmp_path / "d.png").exists()


def test_identify_scale(tmp_path):
    text = run("scale", "ldu_printer", "--speed", "50mm/s", "--luminance", "--plot", str(tmp_path / "s.png"))
    assert "18.75" in text and "radius +1.8" in text
    assert (tmp_path / "s.png").exists() and (tmp_path / "s-luminance.png").exists()


def test_identify_steps():
    assert "12.5000" in run("steps", "ivu")


def test_invalid_arguments_are_refused():
    with pytest.raises(UserError, match="for ldu, not for ivu"):
        run("driver", "ivu")
    with pytest.raises(UserError, match="write numbers with commas"):
        run("friction", "ivu", "--speeds", "slow")
    with pytest.raises(UserError, match=r"--travel 600kg: .* is not a quantity in m"):
        run("scale", "ldu_printer", "--travel", "600kg")
    with pytest.raises(NoAnswer, match="tripped"):
        run("radius", "ivu", "--set", "safety.following_error=0.0001")
