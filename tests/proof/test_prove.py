"""The proof pipeline with a mock diagnosis: resumption, failures, seal."""

import json
from threading import Event

import pytest
from typer.testing import CliRunner

from rtctl.config.errors import UserError
from rtctl.diagnose.folder import Outcome
from rtctl.proof import prove, seal


@pytest.fixture
def folder(tmp_path):
    """Two sealed cases without recordings."""
    effects = [{"name": "drive.lag", "node": "drive", "nodes_ok": ["drive"], "axes_ok": ["time"], "sizes": {}}]
    common = {"plant": "axis", "ratio": 9.0, "true_parameters": {}}
    answers = {
        "cases": {
            "case-0001": {"kind": "single", "size": 1.0, "effects": effects, **common},
            "case-0002": {"kind": "null", "size": None, "effects": [], **common},
        },
        "format": 1, "mix": "proof seed 1",
    }  # fmt: skip
    for name in answers["cases"]:
        (tmp_path / name).mkdir()
    seal.close_seal(tmp_path, answers)
    return tmp_path


def mock_diagnosis(task, report):
    """Mock diagnosis: correct for the first case, an error for the second."""
    if task.name == "case-0002":
        return Outcome(task.name, 1, 0.1, message="no such column")
    task.out.mkdir(exist_ok=True)
    found = {"verdict": "named", "effects": [{"name": "drive.lag", "node": "drive", "confidence": 0.9}]}
    (task.out / prove.RESULT).write_text(json.dumps(found))
    return Outcome(task.name, 0, 0.1, found)


def test_cases_are_diagnosed_once_and_scored(folder):
    seen, again = [], []
    prove.diagnose_all(folder, progress=lambda n, of: seen.append((n, of)), work=mock_diagnosis)
    prove.diagnose_all(folder, progress=lambda n, of: again.append((n, of)), work=mock_diagnosis)
    assert seen == [(1, 2), (2, 2)]
    assert again == []
    result = prove.score_all(folder)
    assert result["single"]["top1"] == 1.0
    assert result["missing"] == 1
    assert "no such column" in (folder / "case-0002" / "diagnosis" / prove.FAILED).read_text()
    assert json.loads((folder / prove.SCORES).read_text())["single"]["top1"] == 1.0
    assert "Concealed cases" in (folder / prove.REPORT).read_text()


def endless(task, report):
    """Mock diagnosis that never ends."""
    Event().wait()


def test_timed_out_case_is_recorded_with_the_limit(folder):
    prove.diagnose_all(folder, work=endless, limit=0.2)
    failed = (folder / "case-0001" / "diagnosis" / prove.FAILED).read_text()
    assert "not done within --limit 0.2 s" in failed


def test_broken_seal_prevents_scoring(folder):
    (folder / seal.ANSWERS).write_text((folder / seal.ANSWERS).read_text().replace("drive.lag", "drive.offset"))
    with pytest.raises(UserError, match="not what was sealed"):
        prove.score_all(folder)


def test_folder_with_cases_of_another_seed_is_refused(folder):
    assert len(prove.prepare(folder, 2, 1, ("axis",), 1, False, None)) == 64
    with pytest.raises(UserError, match="name another --out"):
        prove.prepare(folder, 2, 7, ("axis",), 1, False, None)


def test_machine_cases_and_plant_cases_are_not_mixed(folder):
    sealed = seal.open_seal(folder)
    seal.close_seal(folder, sealed | {"mix": "proof of machines, seed 1", "format": 2})
    assert len(prove.prepare(folder, 2, 1, ("belt",), 1, False, None, machines=True)) == 64
    with pytest.raises(UserError, match="name another --out"):
        prove.prepare(folder, 2, 1, ("axis",), 1, False, None)


@pytest.mark.parametrize(
    ("options", "said"),
    [(["--machines", "--plants", "axis"], "--topologies"), (["--topologies", "belt"], "needs --machines"),
     (["--machines", "--topologies", "boat"], "'boat' is not one of belt")],
)  # fmt: skip
def test_incompatible_options_are_refused(tmp_path, options, said):
    from rtctl.cli.prove import app

    answer = CliRunner().invoke(app, [*options, "--count", "1", "--out", str(tmp_path / "new"), "--generate-only"])
    assert answer.exit_code != 0
    assert said in str(answer.exception)


def test_command_prints_scores_or_hash_as_json(folder):
    from rtctl.cli.prove import app

    answer = CliRunner().invoke(app, ["--count", "2", "--seed", "1", "--out", str(folder), "--json"])
    assert answer.exit_code == 0, answer.output
    assert json.loads(answer.stdout.strip().splitlines()[-1])["cases"] == 2
    answer = CliRunner().invoke(app, ["--count", "2", "--seed", "1", "--out", str(folder), "--generate-only", "--json"])
    assert len(json.loads(answer.stdout.strip().splitlines()[-1])["sha256"]) == 64
