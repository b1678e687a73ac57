"""Diagnosis of a folder by workers of Dask: the same outcomes as by processes here, and what goes wrong is told."""

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
    """A bundle that cannot be read and one in which nothing moves: outcomes that take no fit."""
    bad = bundle(tmp_path / "runs" / "bad", 0)
    (bad / "recording.parquet").write_bytes(b"no parquet")
    still = bundle(tmp_path / "runs" / "short", 1, 0.02)
    assert still.is_dir()
    return tmp_path / "runs"


def test_the_command_gives_what_the_function_gives(folder: Path) -> None:
    for task in tasks(folder):
        here, there = one(task, False), elsewhere._one(task, 120.0, False)
        assert (there.name, there.code, there.diagnosis) == (here.name, here.code, here.diagnosis)
        assert here.code in (2, 3) and there.message == here.message


def test_workers_of_a_scheduler(folder: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask (distributed) is not installed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        found = {
            o.name: o.code for o in elsewhere.diagnose_elsewhere(tasks(folder), cluster.scheduler_address, 120.0, False)
        }
    assert found == {"bad": 2, "short": 3}


def test_a_diagnosis_that_takes_too_long_is_ended(folder: Path) -> None:
    outcome = elsewhere._one(tasks(folder)[0], 0.05, False)
    assert outcome.code == 1 and "not done within --limit 0.05 s" in outcome.message


def test_a_worker_that_does_not_see_the_bundle(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="does not see"):
        elsewhere._one(Task("a", tmp_path / "nowhere", tmp_path / "out"), 1.0, False)


def test_the_diagnosis_is_what_the_command_prints(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Ran:
        returncode, stdout, stderr = 0, json.dumps({"verdict": "nothing"}), ""

    asked: list[Any] = []
    monkeypatch.setattr(elsewhere.subprocess, "run", lambda command, **_: asked.append(command) or Ran())
    task = tasks(folder)[0]._replace(other=folder / "short")
    assert elsewhere._one(task, 1.0, True).diagnosis == {"verdict": "nothing"}
    assert asked[0][-2:] == ["--heldout", str(folder / "short")] and "--no-report" not in asked[0]
