"""Comparison of two programs on the same cases: differences, and the better program in each case."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from rtctl.cli.prove import app
from rtctl.config.errors import UserError
from rtctl.proof import against, prove, seal

EFFECT = {"name": "drive.lag", "node": "drive", "nodes_ok": ["drive"], "axes_ok": ["time"], "sizes": {}}
LAG = {"verdict": "named", "effects": [{"name": "drive.lag", "node": "drive", "confidence": 0.9}]}
DELAY = {"verdict": "named", "effects": [{"name": "timing.delay", "node": "loop", "confidence": 0.9}]}
NOTHING = {"verdict": "nothing", "effects": []}


def folder_of(path, *found):
    """Sealed folder of single-effect cases with the diagnoses `found`."""
    common = {"kind": "single", "size": 1.0, "plant": "axis", "ratio": 9.0, "true_parameters": {}}
    cases = {f"case-{n:04}": {**common, "effects": [EFFECT]} for n in range(1, len(found) + 1)}
    for name, diagnosis in zip(cases, found, strict=True):
        (path / name / "diagnosis").mkdir(parents=True)
        (path / name / "diagnosis" / prove.RESULT).write_text(json.dumps(diagnosis))
    seal.close_seal(path, {"cases": cases, "format": 1, "mix": "proof seed 1"})
    return path


@pytest.fixture
def folders(tmp_path):
    """Folders with the diagnoses of the present and of the earlier program."""
    return folder_of(tmp_path / "now", LAG, LAG, DELAY), folder_of(tmp_path / "before", NOTHING, LAG, LAG)


def test_changed_answers_are_better_or_worse(folders):
    found = against.pairs(*folders)
    assert [(p.case, p.change) for p in found] == [("case-0001", "better"), ("case-0003", "worse")]
    assert (found[0].before, found[0].now) == ("nothing", "named drive.lag:drive")
    assert "1 better, 1 worse" in against.words(found)


def test_equal_answers_are_reported_in_one_sentence(folders):
    now, _ = folders
    assert against.words(against.pairs(now, now)) == "both programs answer all cases alike"


def test_case_without_an_answer_is_omitted(folders):
    now, before = folders
    shutil.rmtree(before / "case-0001" / "diagnosis")
    assert [p.case for p in against.pairs(now, before)] == ["case-0003"]


def test_folder_with_other_cases_is_refused(folders, tmp_path):
    now, _ = folders
    with pytest.raises(UserError, match="holds other cases than"):
        against.pairs(now, folder_of(tmp_path / "other", LAG))


def test_command_prints_the_answers_of_both_programs(folders, monkeypatch):
    now, before = folders
    monkeypatch.setattr(prove, "prepare", lambda *_: "hash")
    asked = ["--count", "3", "--out", str(now), "--against", str(before)]
    printed = CliRunner().invoke(app, asked)
    assert printed.exit_code == 0, printed.output
    assert "| case-0001 | drive.lag | nothing | named drive.lag:drive | better |" in printed.output
    told = json.loads(CliRunner().invoke(app, [*asked, "--json"]).stdout)
    assert [pair["change"] for pair in told["against"]] == ["better", "worse"]
