"""Folders renamed or deleted during a recording: detected, reported, and every lost row counted."""

import os
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from trace_rows import CASE, COLUMNS, ROW, is_truth, make

from rtctl.trace import moved, recorder
from rtctl.trace.bundle import load_bundle
from rtctl.trace.orders import Journal, orders
from rtctl.trace.recorder import Recorder
from rtctl.trace.repair import repair
from rtctl.trace.rotation import Rotation

PARTS = Rotation(minutes=1 / 600)  # 50 rows


@pytest.fixture(autouse=True)
def looks_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "LOOK", 0.0)


def record(folder: Path, rotation: Rotation | None = None) -> Recorder:
    run = Recorder(folder, COLUMNS, ROW, CASE, rotation=rotation)
    put(run, 0, 60)
    return run


def put(run: Recorder, first: int, end: int) -> None:
    run.put(make(first, end - first))
    until(lambda: not run.stats().rows_queued)


def until(what: Callable[[], Any]) -> None:
    deadline = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def test_recording_follows_a_renamed_folder(tmp_path: Path) -> None:
    run = record(tmp_path / "run")
    (tmp_path / "run").rename(tmp_path / "other")
    put(run, 60, 90)
    error = run.stats().error
    assert error == f"{tmp_path / 'run'} was renamed while it was recorded: the recording is now {tmp_path / 'other'}"
    assert run.finish() == tmp_path / "other" and not (tmp_path / "run").exists()
    found = load_bundle(tmp_path / "other")
    assert is_truth(found.columns, range(90)) and len(found.columns["tick"]) == 90
    assert found.case["recording_moved"] == [error] and found.case["complete"] is True


def test_rows_of_a_deleted_folder_are_rescued(tmp_path: Path) -> None:
    (tmp_path / "run-rescued").mkdir()  # folder of an earlier run
    run = record(tmp_path / "run")
    shutil.rmtree(tmp_path / "run")
    put(run, 60, 90)
    assert "was deleted while it was recorded: its rows are rescued into" in str(run.trouble)
    rescued = tmp_path / "run-rescued-2"
    assert (rescued / "recording.arrows").exists()  # written at once: `repair` finds the rows after a kill
    put(run, 90, 100)
    assert run.finish() == rescued and is_truth(load_bundle(rescued).columns, range(100))
    assert list((tmp_path / "run-rescued").iterdir()) == []


def test_folder_deleted_at_the_end_is_detected(tmp_path: Path) -> None:
    run = record(tmp_path / "run")
    shutil.rmtree(tmp_path / "run")
    assert is_truth(load_bundle(run.finish()).columns, range(60)) and run.trouble


@pytest.mark.parametrize("how", ["file", "another"])
def test_deleted_or_replaced_stream_file_is_rescued(tmp_path: Path, how: str) -> None:
    run = record(tmp_path / "run")
    (tmp_path / "run" / "recording.arrows").unlink()
    if how == "another":
        (tmp_path / "run" / "recording.arrows").write_text("mine")
    put(run, 60, 90)
    assert run.finish() == tmp_path / "run-rescued"
    assert is_truth(load_bundle(tmp_path / "run-rescued").columns, range(90))
    assert how == "file" or (tmp_path / "run" / "recording.arrows").read_text() == "mine"


def test_recording_follows_the_parts_of_a_renamed_folder(tmp_path: Path) -> None:
    run = record(tmp_path / "run", PARTS)
    (tmp_path / "run").rename(tmp_path / "other")
    for first in range(60, 200, 35):
        put(run, first, first + 35)
    assert run.finish() == tmp_path / "other" and not (tmp_path / "run").exists()
    found = load_bundle(tmp_path / "other")
    assert is_truth(found.columns, range(200)) and found.case["complete"] is True
    assert len(found.case["parts"]) == 4
    assert "was renamed" in found.case["recording_moved"][0]


def test_deleted_parts_are_counted_and_the_open_part_is_rescued(tmp_path: Path) -> None:
    run = record(tmp_path / "run", PARTS)
    until((tmp_path / "run" / "part-0001" / "recording.parquet").exists)
    until(lambda: not (tmp_path / "run" / "part-0001" / "recording.arrows").exists())
    shutil.rmtree(tmp_path / "run")
    put(run, 60, 130)
    rescued = tmp_path / "run-rescued"
    assert str(run.trouble).endswith("1 full parts went with it")
    assert run.finish() == rescued and not (tmp_path / "run").exists()
    found = load_bundle(rescued)
    assert found.columns["tick"].tolist() == list(range(50, 130))
    assert found.case["losses"] == {"rows": 50, "gaps": [[0, 50]]} and found.case["rows"] == 80
    assert found.case["complete"] is False and run.stats().rows_lost == 50
    assert repair(rescued).changed is False


def test_single_deleted_part_is_restored(tmp_path: Path) -> None:
    run = record(tmp_path / "run", PARTS)
    shutil.rmtree(tmp_path / "run" / "part-0002")
    put(run, 60, 130)
    assert "part-0002 was moved or deleted" in str(run.trouble)
    assert run.finish() == tmp_path / "run" and is_truth(load_bundle(tmp_path / "run").columns, range(130))


def test_rescue_without_disk_space_is_reported_and_retried_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record(tmp_path / "run")
    shutil.rmtree(tmp_path / "run")

    def full(*_: Any) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(moved, "copied", full)
        put(run, 60, 90)
        assert "No space left" in str(run.stats().error) and run.stats().rows_lost == 30
        with pytest.raises(OSError, match="No space left"):
            run.finish()
    assert list(tmp_path.iterdir()) == []
    folder = run.finish()
    found = load_bundle(folder)
    assert is_truth(found.columns, range(60)) and found.case["losses"] == {"rows": 30, "gaps": [[60, 30]]}


def test_journal_follows_the_rescued_folder(tmp_path: Path) -> None:
    command = np.zeros(1, [("order", "i8"), ("arm", "i8")])[0]
    journal = Journal()
    for name in ("run", "rescued"):
        (tmp_path / name).mkdir()
    journal.open(tmp_path / "run")
    command["order"] = 1
    journal.note(command, {})
    shutil.rmtree(tmp_path / "run")
    journal.follow(tmp_path / "rescued")
    command["order"] = 2
    journal.note(command, {})
    journal.follow(tmp_path / "rescued")
    journal.close()
    assert list(orders(tmp_path / "rescued")) == [1, 2]


def test_pipe_always_counts_as_in_place(tmp_path: Path) -> None:
    ends = os.pipe()
    assert moved.in_place(ends[0], tmp_path / "nowhere")
    for end in ends:
        os.close(end)
