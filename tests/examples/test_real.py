"""Recordings of real machines (outside of the project, optional): descriptions and verdicts."""

import json

import pytest
from real_cases import DATA, FOLDER, cases, diagnosis, imports, missing
from typer.testing import CliRunner

from rtctl.cli.main import app

CASES = cases()
SHORT = [name for name, case in CASES.items() if case.get("short")]
DESCRIBED = [name for name, case in CASES.items() if "machine" in case]


@pytest.fixture(scope="module", autouse=True)
def data():
    if not DATA.is_dir():
        pytest.skip(f"{DATA} is not here")


@pytest.fixture
def ran(monkeypatch):
    """A function that runs a command in the folder of the examples and returns what it prints as JSON."""
    monkeypatch.chdir(FOLDER)

    def run(words):
        done = CliRunner().invoke(app, [*words, "--json"])
        assert done.exit_code == 0, done.output
        return json.loads(done.stdout)

    return run


@pytest.mark.parametrize("name", DESCRIBED)
def test_real_recording_is_imported_and_ready_for_a_diagnosis(name, ran, tmp_path):
    if missing(CASES[name]):
        pytest.skip(f"{missing(CASES[name])} is not here")
    for words in imports(CASES[name], tmp_path):
        told = ran(words)
        assert told["lacks"] is None and told["rows"] > 0


@pytest.mark.long
@pytest.mark.parametrize("name", SHORT)
def test_diagnosis_of_a_real_recording_agrees_with_the_known_effects(name, ran, tmp_path):
    case = CASES[name]
    for words in imports(case, tmp_path):
        ran(words)
    found, holds = ran([*diagnosis(case, tmp_path), "--no-report"]), case["holds"]
    named = {f"{e['name']}@{e['node']}": e for e in found["effects"]}
    assert found["verdict"] in holds["verdicts"]
    assert not {e["name"] for e in found["effects"]} & set(case.get("wrong", []))
    for effect, sizes in holds.get("effects", {}).items():
        for parameter, (low, high) in sizes.items():
            assert low <= named[effect]["parameters"][parameter]["value"] <= high
    assert found["fit"]["heldout_nrmse_after"] <= holds["heldout"]


@pytest.mark.parametrize("name", CASES)
def test_each_case_names_its_independent_knowledge(name):
    assert set(CASES[name]) <= {"machine", "recordings", "map", "unit", "import", "options", "known", "wrong", "short",
                                "holds"}  # fmt: skip
    assert CASES[name]["known"]
    assert ("holds" in CASES[name]) == bool(CASES[name].get("short"))
