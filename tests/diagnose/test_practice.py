"""Practice bundles with known answers, which lie beside the project where they are there at all.

RTCTL_PROOF=full diagnoses all of them; otherwise three, cut short, of which one is asked a few questions only.
"""

import json
import os
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from rtctl.diagnose import chain, find
from rtctl.diagnose.diagnosis import as_json
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.record import Record, load_record
from rtctl.diagnose.rest import upto
from rtctl.proof.score import score

FULL = os.environ.get("RTCTL_PROOF") == "full"
NULL, SINGLE, DRIVE = "case-0018", "case-0020", "case-0006"
PLAIN = ("friction.coulomb", "friction.viscous", "friction.stribeck", "drive.offset", "load.spring")
VISIBLE = 0.3  # times the noise floor


def first(record: Record, seconds: float) -> Record:
    """The beginning of a recording."""
    return upto(record, round(seconds / record.dt))


def written(d: Any) -> dict[str, Any]:
    """As it comes back from diagnosis.json."""
    return dict(json.loads(json.dumps(as_json(d))))


@pytest.fixture(scope="module")
def answers(practice: Path) -> dict[str, Any]:
    return dict(json.loads((practice / "answers.json").read_text())["cases"])


@pytest.fixture(scope="module")
def some(practice: Path) -> dict[str, Any]:
    """Three diagnoses."""
    made = {
        NULL: written(chain.diagnose_record(first(load_record(practice / NULL), 6.0))),
        SINGLE: written(chain.diagnose_record(first(load_record(practice / SINGLE), 10.0))),
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(find, "hypotheses", partial(hypotheses, only=PLAIN))
        made[DRIVE] = written(chain.diagnose_record(first(load_record(practice / DRIVE), 2.5)))
    return made


@pytest.mark.skipif(FULL, reason="all of them are diagnosed")
def test_nothing_is_found_where_nothing_is(some, answers):
    assert some[NULL]["verdict"] == "nothing"
    assert some[NULL]["effects"] == []
    assert some[NULL]["hides"]


@pytest.mark.skipif(FULL, reason="all of them are diagnosed")
@pytest.mark.parametrize("case", [SINGLE, DRIVE])
def test_a_single_effect_is_named_at_its_node(some, answers, case):
    assert some[case]["verdict"] in ("named", "ambiguous")
    effect, true = some[case]["effects"][0], answers[case]["effects"][0]
    assert effect["name"] == true["name"]
    assert effect["node"] in true["nodes_ok"]
    assert some[case]["located"]["axis"] in true["axes_ok"]
    fit = some[case]["fit"]
    assert fit["heldout_nrmse_after"] < fit["heldout_nrmse_before"]


@pytest.mark.skipif(FULL, reason="all of them are diagnosed")
def test_the_score_of_three_is_full(some, answers):
    result = score({case: answers[case] for case in some}, some, VISIBLE)
    assert result["missing"] == 0
    assert result["failures"] == []
    assert result["null"]["false_alarms"] == 0
    assert result["single"]["top1"] == 1.0
    assert result["node_accuracy"] == 1.0


@pytest.fixture(scope="module")
def all_of_them(practice: Path, answers: dict[str, Any]) -> dict[str, Any]:
    return {case: written(chain.diagnose(practice / case)) for case in sorted(answers)}


@pytest.mark.skipif(not FULL, reason="takes a quarter of an hour; RTCTL_PROOF=full runs it")
@pytest.mark.timeout(3600)
def test_all_practice_bundles_hold(all_of_them, answers, record_property):
    """No false alarm, and nine in ten visible singles named or among the names of an ambiguous verdict."""
    result = score(answers, all_of_them, VISIBLE)
    record_property("score", json.dumps(result))
    print(json.dumps(result, indent=1))
    assert result["missing"] == 0
    assert result["null"]["false_alarms"] == 0, result["failures"]
    singles = [c for c, a in answers.items() if a["kind"] == "single" and a["ratio"] >= VISIBLE]
    hit = [c for c in singles if answers[c]["effects"][0]["name"] in named(all_of_them[c])]
    assert len(hit) >= 0.9 * len(singles), sorted(set(singles) - set(hit))


def named(d: dict[str, Any]) -> list[str]:
    """Names that a diagnosis gives."""
    return [e["name"] for e in d["effects"]] if d["verdict"] in ("named", "ambiguous") else []
