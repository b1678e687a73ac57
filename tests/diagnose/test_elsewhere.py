"""Diagnosis of a folder on Dask workers: outcomes equal to local processes, and error reports."""

import json
from pathlib import Path
from typing import Any

import pytest

from rtctl.config.errors import UserError
from rtctl.diagnose import elsewhere
from rtctl.diagnose.folder import Task, one, tasks
from tests.trend.bundles import bundle


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Folder with an unreadable bundle and a too short bundle: outcomes without a fit."""
    bad = bundle(tmp_path / "runs" / "bad", 0)
    (bad / "recording.parquet").write_bytes(b"no parquet")
    still = bundle(tmp_path / "runs" / "short", 1, 0.02)
    assert still.is_dir()
    return tmp_path / "runs"


def test_subprocess_and_function_give_equal_outcomes(folder: Path) -> None:
    for task in tasks(folder):
        here, there = one(task, False), elsewhere._one(task, 120.0, False)
        assert (there.name, there.code, there.diagnosis) == (here.name, here.code, here.diagnosis)
        assert here.code in (2, 3) and there.message == here.message


def test_dask_workers_return_the_exit_codes(folder: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask (distributed) is not installed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        found = {
            o.name: o.code for o in elsewhere.diagnose_elsewhere(tasks(folder), cluster.scheduler_address, 120.0, False)
        }
    assert found == {"bad": 2, "short": 3}


def test_diagnosis_beyond_its_time_limit_is_ended(folder: Path) -> None:
    outcome = elsewhere._one(tasks(folder)[0], 0.05, False)
    assert outcome.code == 1 and "not done within --limit 0.05 s" in outcome.message


def test_worker_without_access_to_the_bundle_is_reported(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does not see"):
        elsewhere._one(Task("a", tmp_path / "nowhere", tmp_path / "out"), 1.0, False)


def test_outcome_holds_the_printed_diagnosis(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Ran:
        returncode, stdout, stderr = 0, json.dumps({"verdict": "nothing"}), ""

    asked: list[Any] = []
    monkeypatch.setattr(elsewhere.subprocess, "run", lambda command, **_: asked.append(command) or Ran())
    task = tasks(folder)[0]._replace(other=folder / "short")
    assert elsewhere._one(task, 1.0, True).diagnosis == {"verdict": "nothing"}
    assert asked[0][-2:] == ["--heldout", str(folder / "short")] and "--no-report" not in asked[0]
