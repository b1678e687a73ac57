import json
import shutil

import pytest
from graph_cases import PENDULUM, case_of, columns_of, command, write_bundle
from typer.testing import CliRunner

from rtctl.cli.main import app
from rtctl.config.errors import UserError
from rtctl.diagnose.answer.second import predicted
from rtctl.diagnose.bundles import diagnose_into, of_one_machine
from rtctl.diagnose.folder import Task, one


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Bundle of a nominal pendulum, with a held-out recording."""
    folder = tmp_path_factory.mktemp("benches")
    for name, seed in (("swing", 1), ("swing-heldout", 2)):
        u = command(4.0, seed=seed)
        write_bundle(folder / name, case_of(PENDULUM), columns_of(case_of(PENDULUM), u))
    return folder / "swing"


def test_diagnosis_writes_its_files(bench, tmp_path):
    made = diagnose_into(bench, None, tmp_path / "out")
    assert made.data["verdict"] == "nothing"
    assert not made.faults
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"diagnosis.json", "model.yaml", "report.html"}
    assert json.loads((tmp_path / "out" / "diagnosis.json").read_text()) == made.data


def test_second_recording_is_the_held_out_data(bench, tmp_path):
    made = diagnose_into(bench, bench.parent / "swing-heldout", tmp_path / "out", report=False)
    assert made.diagnosis.heldout.rows[1] == 2000  # all rows of the second recording
    assert made.data["fit"]["heldout_nrmse_before"] < 2e-4
    case = json.loads((bench / "case.json").read_text())
    case["machine"]["bodies"]["other"] = {"inertia": 1.0}
    case["machine"]["joints"] = {"shaft": {"from": "rod", "to": "other"}}
    shutil.copytree(bench, tmp_path / "else")
    (tmp_path / "else" / "case.json").write_text(json.dumps(case))
    with pytest.raises(UserError, match=r"machine\.bodies has other, rod, and the first recording has rod"):
        predicted(made.diagnosis, tmp_path / "else")


def test_invalid_case_in_a_folder_is_reported(bench, tmp_path):
    shutil.copytree(bench, tmp_path / "bad")
    (tmp_path / "bad" / "case.json").write_text('{"format": 2, "machine": {"bodies": {}}}')
    outcome = one(Task("bad", tmp_path / "bad", tmp_path / "out"), report=False)
    assert outcome.code == 2
    assert "machine" in outcome.message


def test_command_line_prints_json_or_text(bench, tmp_path):
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["diagnose", str(bench), "--out", str(out), "--no-report", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["verdict"] == "nothing"
    assert not (out / "report.html").exists()
    done = CliRunner().invoke(app, ["diagnose", str(bench), "--out", str(out), "--no-report"])
    assert "Nothing is missing" in done.stdout
    assert "model" in done.stdout


@pytest.mark.parametrize(
    ("groups", "together", "sentence"),
    [
        (("leg", "leg"), False, ""),
        (("", ""), True, ""),
        (("", ""), False, "give --together"),
        (("leg", "arm"), False, "give --together"),
        (("leg", ""), False, "group is missing"),
    ],
)
def test_recordings_of_one_machine_need_a_group_or_a_flag(tmp_path, groups, together, sentence):
    bundles = []
    for i, group in enumerate(groups):
        folder = tmp_path / str(i)
        folder.mkdir()
        (folder / "case.json").write_text(json.dumps(case_of(PENDULUM, group=group)))
        bundles.append(folder)
    if not sentence:
        of_one_machine(bundles, together)
        return
    with pytest.raises(UserError, match=sentence):
        of_one_machine(bundles, together)
