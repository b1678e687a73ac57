import json
import os
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trace_rows import CASE, COLUMNS, ROW, is_truth, make

from rtctl.config.errors import UserError
from rtctl.trace.bundle import load_bundle
from rtctl.trace.recorder import Recorder
from rtctl.trace.repair import repair
from rtctl.trace.stream import StreamWriter


@pytest.fixture
def slow_disk(monkeypatch):
    """Every write waits until the event is set; `began` is set when a write waits."""
    go, began, write = threading.Event(), threading.Event(), StreamWriter.write

    def wait(self, rows):
        began.set()
        assert go.wait(60)
        return write(self, rows)

    monkeypatch.setattr(StreamWriter, "write", wait)
    go.began = began
    yield go
    go.set()


def recorder(folder, rows_queued=1_000_000, case=CASE):
    return Recorder(folder, COLUMNS, ROW, case, max_queued_bytes=rows_queued * ROW.itemsize)


def test_recording_becomes_a_bundle(tmp_path):
    run = recorder(tmp_path / "new" / "run")
    assert json.loads((tmp_path / "new/run/case.json").read_text())["complete"] is False
    for first in range(0, 5000, 100):
        assert run.put(make(first, 100)) == 0
    folder = run.finish({"notes": "good"})
    assert folder == run.finish()
    found = load_bundle(folder)
    assert is_truth(found.columns, range(5000))
    assert {k: found.case[k] for k in CASE} == CASE
    assert found.case["complete"] is True and found.case["rows"] == 5000 and found.case["notes"] == "good"
    assert found.case["losses"] == {"rows": 0, "gaps": []}
    assert found.case["recorded_at"].endswith("+00:00")
    assert sorted(p.name for p in folder.iterdir()) == ["case.json", "recording.parquet"]


def test_slow_disk_never_blocks_and_losses_are_exact(tmp_path, slow_disk):
    run = recorder(tmp_path, rows_queued=25)
    assert run.put(make(0, 10)) == 0
    assert slow_disk.began.wait(60)
    assert [run.put(make(first, 10)) for first in (10, 20, 30)] == [0, 5, 10]
    run.note_lost(40, 7)
    stats = run.stats()
    assert (stats.rows_written, stats.rows_queued, stats.rows_lost) == (0, 25, 22)
    assert stats.bytes_queued == 25 * ROW.itemsize
    slow_disk.set()
    case = load_bundle(run.finish()).case
    assert case["losses"] == {"rows": 22, "gaps": [[25, 22]]} and case["complete"] is False
    assert is_truth(load_bundle(tmp_path).columns, range(25))


@settings(deadline=None, max_examples=25)
@given(
    steps=st.lists(st.tuples(st.sampled_from(["put", "ring"]), st.integers(0, 30)), max_size=20),
    queued=st.integers(0, 60),
)
def test_every_row_is_either_in_the_bundle_or_in_the_losses(tmp_path_factory, steps, queued):
    run, tick = recorder(tmp_path_factory.mktemp("r") / "run", rows_queued=queued), 0
    for what, count in steps:
        if what == "put":
            run.put(make(tick, count))
        else:
            run.note_lost(tick, count)
        stats = run.stats()
        tick += count
        assert stats.rows_written + stats.rows_queued + stats.rows_lost == tick
        assert stats.bytes_queued <= queued * ROW.itemsize
    folder = run.finish()
    case = json.loads((folder / "case.json").read_text())
    lost = [t for first, count in case["losses"]["gaps"] for t in range(first, first + count)]
    kept = sorted(set(range(tick)) - set(lost))
    assert case["losses"]["rows"] == len(lost) and case["rows"] == len(kept)
    assert case["complete"] is (not lost)
    if kept:
        assert is_truth(load_bundle(folder).columns, kept)


def test_full_disk_keeps_the_written_rows_and_counts_the_rest_as_lost(tmp_path, small_disk, slow_disk):
    run = recorder(tmp_path)
    run.put(make(0, 100))
    with small_disk(6000):
        slow_disk.set()
        for first in range(100, 1000, 100):
            run.put(make(first, 100))
        folder = run.finish()
    found = load_bundle(folder)
    kept = len(found.columns["t"])
    assert 0 < kept < 1000 and kept % 100 == 0 and is_truth(found.columns, range(kept))
    assert found.case["losses"] == {"rows": 1000 - kept, "gaps": [[kept, 1000 - kept]]}
    assert found.case["complete"] is False and "File too large" in found.case["recording_error"]
    assert "File too large" in run.stats().error


def test_stream_and_losses_are_kept_without_space_for_the_parquet(tmp_path, small_disk):
    run = recorder(tmp_path, case={"format": 1})
    run.put(make(0, 20_000))
    run.note_lost(20_000, 3)
    while run.stats().rows_queued:
        os.sched_yield()
    with small_disk(50_000), pytest.raises(OSError):
        run.finish()
    told = json.loads((tmp_path / "case.json").read_text())
    assert told["losses"] == {"rows": 3, "gaps": [[20_000, 3]]} and told["complete"] is False
    report = repair(tmp_path)
    found = load_bundle(tmp_path)
    assert report.rows == found.case["rows"] == 20_000 and is_truth(found.columns, range(20_000))
    assert found.case["losses"] == told["losses"] and found.case["repaired"] is True


def test_exception_in_the_writer_is_reported(tmp_path, monkeypatch):
    def broken(self, rows):
        raise KeyError("no such thing")

    monkeypatch.setattr(StreamWriter, "write", broken)
    run = recorder(tmp_path)
    run.put(make(0, 10))
    case = json.loads((run.finish() / "case.json").read_text())
    assert case["losses"]["rows"] == 10 and "no such thing" in case["recording_error"]


def test_folder_with_a_recording_is_refused(tmp_path):
    recorder(tmp_path).finish()
    with pytest.raises(UserError, match=r"already holds recording\.parquet"):
        recorder(tmp_path)


def test_finished_recorder_accepts_no_rows(tmp_path):
    run = recorder(tmp_path)
    run.finish()
    with pytest.raises(RuntimeError, match="finished"):
        run.put(make(0, 1))


def test_counts_are_consistent_at_every_moment(tmp_path):
    run = recorder(tmp_path, rows_queued=300)
    done, seen = threading.Event(), []

    def look():
        while not done.is_set():
            stats = run.stats()
            seen.append(stats.rows_written + stats.rows_queued + stats.rows_lost)

    watcher = threading.Thread(target=look)
    watcher.start()
    for first in range(0, 20_000, 50):
        run.put(make(first, 50))
    done.set()
    watcher.join()
    folder = run.finish()
    assert all(rows % 50 == 0 for rows in seen) and seen == sorted(seen)  # every row is counted exactly once
    stats = run.stats()
    assert stats.rows_written + stats.rows_lost == 20_000
    assert len(load_bundle(folder).columns["t"]) == stats.rows_written
