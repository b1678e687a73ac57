"""Practice bundles with known answers, beside the project.

RTCTL_PROOF=full diagnoses all of them; the default is two shortened bundles.
"""

import json
from pathlib import Path
from typing import Any

import pytest
from marks import FULL, long_where

from rtctl.diagnose.answer.answer import GraphDiagnosis, diagnose, diagnose_record
from rtctl.diagnose.answer.results import finite
from rtctl.diagnose.model.format1 import graph_record
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.record.format1 import load_record
from rtctl.proof.score import score

LENGTHS = {"case-0018": 6.0, "case-0020": 10.0}  # s; nothing, and a single effect
QUICK = "case-0018"  # nothing is missing: no search for a second effect
VISIBLE = 0.3  # times the noise floor


def first(bundle: Path, seconds: float) -> GraphRecord:
    """First `seconds` of a recording."""
    record = load_record(bundle)
    rows = slice(0, round(seconds / record.dt))
    arrays = {name: getattr(record, name)[rows] for name in ("t", "ref", "w", "u")}
    y, columns = ({k: v[rows] for k, v in values.items()} for values in (record.y, record.columns))
    return graph_record(record._replace(y=y, columns=columns, **arrays))


def written(d: GraphDiagnosis) -> dict[str, Any]:
    """Diagnosis as read from diagnosis.json."""
    return dict(json.loads(json.dumps(finite(d.as_json()))))


@pytest.fixture(scope="module")
def answers(practice: Path) -> dict[str, Any]:
    return dict(json.loads((practice / "answers.json").read_text())["cases"])


@pytest.mark.skipif(FULL, reason="all of them are diagnosed")
@pytest.mark.parametrize("case", long_where(lambda case: case != QUICK, LENGTHS))
def test_shortened_practice_bundles_are_diagnosed_correctly(practice, answers, case):
    found = written(diagnose_record(first(practice / case, LENGTHS[case])))
    result = score({case: answers[case]}, {case: found}, VISIBLE)
    assert result["missing"] == 0
    assert result["failures"] == []


@pytest.mark.skipif(not FULL, reason="takes half an hour; RTCTL_PROOF=full runs it")
@pytest.mark.timeout(7200)
def test_all_practice_bundles_reach_the_required_score(practice, answers, record_property):
    """No false alarm; 90 % of the visible single effects are named, alone or in an ambiguous verdict."""
    all_of_them = {case: written(diagnose(practice / case)) for case in sorted(answers)}
    result = score(answers, all_of_them, VISIBLE)
    record_property("score", json.dumps(result))
    print(json.dumps(result, indent=1))
    assert result["missing"] == 0
    assert result["null"]["false_alarms"] == 0, result["failures"]
    singles = [c for c, a in answers.items() if a["kind"] == "single" and a["ratio"] >= VISIBLE]
    hit = [c for c in singles if answers[c]["effects"][0]["name"] in named(all_of_them[c])]
    assert len(hit) >= 0.9 * len(singles), sorted(set(singles) - set(hit))


def named(d: dict[str, Any]) -> list[str]:
    """Effect names of a named or ambiguous diagnosis."""
    return [e["name"] for e in d["effects"]] if d["verdict"] in ("named", "ambiguous") else []
