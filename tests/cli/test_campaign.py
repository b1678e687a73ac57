"""`rtctl campaign`: exit codes, JSON, messages, and no progress output without a terminal."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

Rtctl = Callable[..., Any]


@pytest.fixture
def file(tmp_path: Path) -> Callable[..., Path]:
    def make(gains: list[Any] | None = None, **changes: Any) -> Path:
        path = tmp_path / "gains.yaml"
        data = {
            "campaign": "gains",
            "config": "ivu",
            "seconds": 1.5,
            "set": {"reference": {"steps": [{"at": 0.1, "to": 1.0}]}},
            "matrix": {"law.position.gain": gains or [25, 31]},
            **changes,
        }
        path.write_text(yaml.safe_dump(data))
        return path

    return make


@pytest.fixture(autouse=True)
def blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stub of the plots: drawing would take longer than the runs."""
    for name in ("overlay", "distributions", "along", "png"):
        monkeypatch.setattr(f"rtctl.campaign.figures.{name}", lambda *_: "")


def test_campaign_runs_and_reuses_finished_runs(rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path) -> None:
    said = rtctl("campaign", "run", file(), "--jobs", 1, "--out", tmp_path / "out", "--json")
    assert said.code == 0 and said.err == ""
    found = json.loads(said.out)
    assert {"runs", "failed", "wall_s"} <= set(found) and (found["runs"], found["failed"]) == (2, 0)
    again = rtctl("campaign", "run", file(), "--jobs", 1, "--out", tmp_path / "out")
    assert again.code == 0 and "2 of them were there already" in again.out and "final_error_mm" in again.out
    assert again.err == "" and "\x1b" not in again.out


def test_failed_run_is_exit_code_1(rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    said = rtctl("campaign", "run", file([31, -3]), "-j", 1, "--out", out, "--json")
    assert said.code == 1 and json.loads(said.out)["failed"] == 1
    assert "1 of 2 runs failed" in said.err and said.err.count("\n") == 1
    listed = rtctl("campaign", "list", out)
    assert listed.code == 0 and "out of bounds" in listed.out
    assert json.loads(rtctl("campaign", "list", out, "--json").out)["failures"][0]["run"] == 1


def test_fail_on_sets_the_exit_code(rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path) -> None:
    def run(*conditions: str) -> Any:
        options = [word for text in conditions for word in ("--fail-on", text)]
        return rtctl("campaign", "run", file(), "-j", 1, "--out", tmp_path / "out", *options)

    assert run("final_error_mm.p99 > 1000", "trip.count > 0").code == 0
    said = run("final_error_mm.p99 > 0.0001", "trip.count > 0")
    assert said.code == 1 and "final_error_mm.p99 is" in said.err and said.err.count("\n") == 1


def test_regression_against_a_baseline_sets_the_exit_code(
    rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path
) -> None:
    rtctl("campaign", "run", file(), "-j", 1, "--out", tmp_path / "old")
    options = ("--baseline", tmp_path / "old", "--fail-on", "regressions.count > 0")
    assert rtctl("campaign", "run", file(), "-j", 1, "--out", tmp_path / "new", *options).code == 0
    slow = file(set={"law.shaper.bandwidth": 5, "reference": {"steps": [{"at": 0.1, "to": 1.0}]}})
    said = rtctl("campaign", "run", slow, "-j", 1, "--out", tmp_path / "slow", *options)
    assert said.code == 1 and "regressions.count is" in said.err and "regressions, " in said.out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--fail-on", "final_eror_mm.p99 > 1"), "did you mean 'final_error_mm'?"),
        (("--fail-on", "regressions.count > 0"), "--baseline DIR"),
        (("--baseline", "nowhere"), "is not the folder of a campaign"),
        (("--for", "soon"), "--for soon"),
        (("--jobs", "0"), "jobs"),
    ],
)
def test_invalid_arguments_are_exit_code_2(
    rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path, options: tuple[str, ...], words: str
) -> None:
    said = rtctl("campaign", "run", file(), "--out", tmp_path / "out", *options)
    assert said.code == 2 and words in said.err and said.err.count("\n") == 1 and not (tmp_path / "out").exists()


def test_invalid_campaign_file_or_folder_is_exit_code_2(
    rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path
) -> None:
    said = rtctl("campaign", "run", "radii_1000")
    assert said.code == 2 and "no such file" in said.err
    said = rtctl("campaign", "run", file(matrix={"law.position.gian": [1]}))
    assert said.code == 2 and "gains.yaml:" in said.err and "did you mean 'gain'?" in said.err
    said = rtctl("campaign", "list", tmp_path)
    assert said.code == 2 and "is not the folder of a campaign" in said.err


def test_folder_of_another_campaign_is_refused(rtctl: Rtctl, file: Callable[..., Path], tmp_path: Path) -> None:
    rtctl("campaign", "run", file(), "-j", 1, "--out", tmp_path / "out")
    said = rtctl("campaign", "run", file([5]), "-j", 1, "--out", tmp_path / "out")
    assert said.code == 2 and "another matrix" in said.err


def test_campaign_of_a_machine_config_is_one_run(rtctl: Rtctl, tmp_path: Path) -> None:
    said = rtctl("campaign", "run", "ivu", "--for", "1s", "-j", 1, "--out", tmp_path / "out", "--json")
    assert said.code == 0 and json.loads(said.out)["runs"] == 1
