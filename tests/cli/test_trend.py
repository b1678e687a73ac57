"""`rtctl trend`: exit codes and messages."""

import json
from pathlib import Path

import pytest

from rtctl.cli.main import main
from rtctl.cli.trend import ALARM
from tests.trend.bundles import bundle, worn


def test_alarm_has_a_separate_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    worn(tmp_path / "runs", 16, 9)
    assert main(["trend", str(tmp_path / "runs"), "--jobs", "1"]) == ALARM == 4
    text = capsys.readouterr().out
    assert "ALARM rail: bodies.carriage.viscous from 2025-03-10" in text and "trend.html" in text
    assert main(["trend", str(tmp_path / "runs"), "--jobs", "1", "--least", "40", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["fitted"] == 0 and found["alarms"] == 0 and len(found["changes"]) == 1


def test_no_change_is_exit_code_0_and_no_bundle_is_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bundle(tmp_path / "runs" / "a", 0)
    assert main(["trend", str(tmp_path / "runs"), "--jobs", "1"]) == 0
    assert "no change" in capsys.readouterr().out
    assert main(["trend", str(tmp_path / "nowhere")]) == 2
    assert main(["trend", str(tmp_path / "runs" / "a"), str(tmp_path)]) == 2
    assert "--out DIR is missing" in capsys.readouterr().err
