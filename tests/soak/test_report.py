"""Summary, JUnit XML and console text of a soak."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from rtctl.soak import report
from rtctl.soak.events import Day
from rtctl.soak.invariants import INVARIANTS
from rtctl.soak.rig import Fused


@pytest.fixture
def found(rig: Callable[..., Fused], tmp_path: Path) -> dict[str, Any]:
    """Result of one event with two manual violations."""
    machine = rig("axis", seed=7)
    day = Day(machine, 7)
    day.step()
    machine.checker.note("memory", 12, 300.0, 200.0)
    machine.checker.note("recovery", 13, 3.0, 2.0)
    machine.checker.flush()
    return report.summary(day, 1.5, 200.0, "fused", tmp_path)


def test_summary_counts_events_and_violations(found: dict[str, Any]) -> None:
    assert found["violations"] == 2 and found["violated"] == {"memory": 1, "recovery": 1}
    assert [v["name"] for v in found["violation_list"]] == ["memory", "recovery"]
    assert all(v["seed"] == 7 and v["signals"] and v["bundle"] for v in found["violation_list"])
    assert {"simulated_hours", "wall_s", "faults", "ticks", "moves", "trips", "invariants"} <= set(found)
    assert found["invariants"]["finite"] == found["ticks"] > 0


def test_violation_with_nan_is_valid_json(rig: Callable[..., Fused], tmp_path: Path) -> None:
    machine = rig("axis", seed=7)
    day = Day(machine, 7)
    day.step()
    machine.checker.note("finite", 12, float("nan"), 3.0)
    machine.checker.kept[0].signals["u"] = float("inf")
    found = report.summary(day, 1.5, 200.0, "fused", tmp_path)
    written = json.loads(report.as_text(found))["violation_list"][0]
    assert (written["value"], written["bound"], written["signals"]["u"]) == (None, 3.0, None)
    assert "nan, allowed 3" in report.sentence(found["violation_list"][0])


def test_junit_has_a_test_case_for_each_invariant(found: dict[str, Any], tmp_path: Path) -> None:
    report.junit(found, tmp_path / "deep" / "soak.xml")
    suite = ElementTree.parse(tmp_path / "deep" / "soak.xml").getroot()
    cases = {case.get("name"): case for case in suite}
    assert list(cases) == list(INVARIANTS)
    assert (suite.get("tests"), suite.get("failures")) == (str(len(INVARIANTS)), "2")
    failure = cases["memory"].find("failure")
    assert failure is not None and "tick 12" in (failure.text or "")
    assert cases["tension"].find("skipped") is not None  # an axis has no tape
    assert not list(cases["finite"])


def test_console_text_names_the_violated_invariants(found: dict[str, Any]) -> None:
    lines = report.words(found)
    assert sum(line.startswith("FAIL") for line in lines) == 2
    assert any(line.startswith("memory at tick 12, event 0 of seed 7") for line in lines)
    assert lines[-1].startswith("2 violations")
