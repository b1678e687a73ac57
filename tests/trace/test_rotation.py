import json
import os
import shutil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trace_rows import CASE, COLUMNS, ROW, is_truth, make

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace.bundle import load_bundle, part_folders
from rtctl.trace.part import Part
from rtctl.trace.recorder import Recorder
from rtctl.trace.repair import repair
from rtctl.trace.rotation import Rotation

SECOND = Rotation(minutes=1 / 60)  # 500 rows of this trace


def recorder(folder, rotation=SECOND, **options):
    return Recorder(folder, COLUMNS, ROW, CASE, rotation=rotation, **options)


def record(folder, rows=1700, size=77, rotation=SECOND, extra=None):
    run = recorder(folder, rotation)
    for first in range(0, rows, size):
        run.put(make(first, min(size, rows - first)))
    return run.finish(extra)


def case(folder):
    return json.loads((folder / "case.json").read_text())


def content(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_parts_are_read_together_and_separately(tmp_path):
    folder = record(tmp_path / "run")
    parts = part_folders(folder)
    assert [part.name for part in parts] == ["part-0001", "part-0002", "part-0003", "part-0004"]
    assert sorted(path.name for path in folder.iterdir()) == ["case.json", *(part.name for part in parts)]
    whole = load_bundle(folder)
    assert is_truth(whole.columns, range(1700)) and whole.units["u1"] == "V"
    assert {key: whole.case[key] for key in CASE} == CASE
    assert (whole.case["rows"], whole.case["complete"], whole.case["losses"]["rows"]) == (1700, True, 0)
    assert whole.case["parts"][3] == {"folder": "part-0004", "rows": 200, "tick": [1500, 1699], "t": [3.0, 3.398]}
    for number, part in enumerate(parts):
        one = load_bundle(part)
        assert is_truth(one.columns, range(500 * number, min(500 * number + 500, 1700)))
        assert {key: one.case[key] for key in CASE} == CASE and one.case["part"] == number + 1
        assert one.case["complete"] is True
        assert sorted(path.name for path in part.iterdir()) == ["case.json", "recording.parquet"]


def test_part_ends_at_its_size_limit(tmp_path):
    folder = record(tmp_path / "run", rows=3000, size=100, rotation=Rotation(megabytes=0.02, minutes=60.0))
    found = case(folder)["parts"]
    assert sum(part["rows"] for part in found) == 3000
    assert {part["rows"] for part in found[:-1]} == {500}  # a part ends with the batch that fills it
    assert is_truth(load_bundle(folder).columns, range(3000))


def test_recording_without_rotation_is_a_bundle_without_parts(tmp_path):
    folder = record(tmp_path / "run", rotation=Rotation())
    assert sorted(path.name for path in folder.iterdir()) == ["case.json", "recording.parquet"]


def test_batch_longer_than_a_part_is_divided(tmp_path):
    folder = record(tmp_path / "run", rows=2600, size=2600)
    assert [part["rows"] for part in case(folder)["parts"]] == [500, 500, 500, 500, 500, 100]


def test_rows_are_written_in_batches(tmp_path):
    run = recorder(tmp_path / "run", rotation=None, batch=60.0)
    for tick in range(200):
        run.put(make(tick, 1))
    alone = Recorder(tmp_path / "alone", COLUMNS, ROW, CASE)
    for tick in range(200):
        alone.put(make(tick, 1))
        while alone.stats().rows_queued:
            os.sched_yield()
    folder = run.finish()  # finish does not wait for the batch time of a minute
    assert is_truth(load_bundle(folder).columns, range(200))
    assert run.stats().bytes_written < alone.stats().bytes_written / 8
    alone.finish()


@settings(deadline=None, max_examples=25)
@given(
    steps=st.lists(st.tuples(st.sampled_from(["put", "ring"]), st.integers(0, 400)), max_size=12),
    queued=st.integers(100, 900),
)
def test_every_row_is_in_one_part_or_in_its_losses(tmp_path_factory, steps, queued):
    folder = tmp_path_factory.mktemp("r") / "run"
    run, tick = recorder(folder, max_queued_bytes=queued * ROW.itemsize), 0
    for what, count in steps:
        if what == "put":
            run.put(make(tick, count))
        else:
            run.note_lost(tick, count)
        tick += count
    run.finish()
    top = case(folder)
    listed = [[first, count] for part in part_folders(folder) for first, count in case(part)["losses"]["gaps"]]
    lost = [t for first, count in listed for t in range(first, first + count)]
    told = [t for first, count in top["losses"]["gaps"] for t in range(first, first + count)]
    assert lost == told and len(lost) == top["losses"]["rows"]
    kept = sorted(set(range(tick)) - set(lost))
    assert top["rows"] == len(kept) and top["complete"] is (not lost)
    if kept:
        assert is_truth(load_bundle(folder).columns, kept)


def test_case_of_a_part_lists_the_changes_until_its_end(tmp_path):
    changes = [{"tick": 10, "path": "a"}, {"tick": 999, "path": "b"}, {"tick": 1000, "path": "c"}]
    folder = record(tmp_path / "run", extra={"changes": changes, "run": {"late": 3}})
    assert case(folder)["changes"] == changes
    assert [len(case(part)["changes"]) for part in part_folders(folder)] == [1, 2, 3, 3]
    assert all(case(part)["run"] == {"late": 3} for part in part_folders(folder))


# failures


def test_part_refused_by_the_disk_is_finished_at_the_end(tmp_path, monkeypatch):
    real, refused = Part.finish, []

    def finish(self, *arguments):
        if self.folder.name == "part-0001" and not refused:
            refused.append(self.folder)
            raise OSError(28, "No space left on device")
        real(self, *arguments)

    monkeypatch.setattr(Part, "finish", finish)
    folder = record(tmp_path / "run")
    assert refused and load_bundle(folder).case["complete"] is True


def test_parts_refused_by_the_disk_are_left_for_repair(tmp_path, monkeypatch):
    def finish(self, *_):
        raise OSError(28, "No space left on device")

    run = recorder(tmp_path / "run")
    with monkeypatch.context() as patch:
        patch.setattr(Part, "finish", finish)
        run.put(make(0, 1700))
        run.note_lost(1700, 3)
        with pytest.raises(OSError, match=r"4 parts could not be made whole, .*part-0001 first"):
            run.finish({"run": {}})
    assert case(run.folder)["losses"]["rows"] == 3
    with pytest.raises(UserError, match="already holds part-0001"):
        recorder(run.folder)
    with pytest.raises(UserError, match="rtctl trace repair"):
        load_bundle(run.folder)
    report = repair(run.folder)
    found = load_bundle(run.folder)
    assert report.rows == 1700 and is_truth(found.columns, range(1700))
    assert found.case["losses"]["rows"] == 3 and found.case["run"] == {}


def test_finish_can_be_repeated_when_there_is_disk_space(tmp_path, monkeypatch):
    def finish(self, *_):
        raise OSError(28, "No space left on device")

    run = recorder(tmp_path / "run")
    run.put(make(0, 1700))
    with monkeypatch.context() as patch:
        patch.setattr(Part, "finish", finish)
        with pytest.raises(OSError, match="4 parts"):
            run.finish()
    found = load_bundle(run.finish())
    assert is_truth(found.columns, range(1700)) and found.case["complete"] is True


def test_full_disk_counts_the_remaining_rows_as_lost(tmp_path, monkeypatch):
    real = Part.__init__

    def full(self, folder, *arguments):
        if folder.name == "part-0003":
            raise OSError(28, "No space left on device")
        real(self, folder, *arguments)

    monkeypatch.setattr(Part, "__init__", full)
    folder = record(tmp_path / "run", rows=2000, size=2000)
    found = load_bundle(folder)
    assert is_truth(found.columns, range(1000))
    assert found.case["losses"] == {"rows": 1000, "gaps": [[1000, 1000]]}
    assert "No space left" in found.case["recording_error"] and found.case["complete"] is False


def test_repair_refuses_a_recording_in_progress(tmp_path):
    run = recorder(tmp_path / "run")
    run.put(make(0, 1200))
    with pytest.raises(UserError, match="in use"):
        repair(run.folder)
    with pytest.raises(UserError, match=r"already holds part-0001|in use"):
        recorder(tmp_path / "run")
    assert is_truth(load_bundle(run.finish()).columns, range(1200))
    assert repair(run.folder).changed is False


def test_missing_part_is_reported_and_the_others_can_be_read(tmp_path):
    folder = record(tmp_path / "run")
    shutil.rmtree(folder / "part-0002")
    with pytest.raises(UserError, match=r"lists other parts than the folder holds .*rtctl trace repair"):
        load_bundle(folder)
    report = repair(folder)
    found = load_bundle(folder)
    kept = [*range(500), *range(1000, 1700)]
    assert report.rows == 1200 and is_truth(found.columns, kept)
    assert found.case["losses"] == {"rows": 500, "gaps": [[500, 500]]} and found.case["complete"] is False
    assert repair(folder).changed is False


@pytest.mark.parametrize("left", ["nothing", "folder", "case", "schema"])
def test_repair_after_a_kill_at_the_start_of_a_part(tmp_path, left):
    folder = record(tmp_path / "run", rows=1000)
    last = folder / "part-0003"
    if left != "nothing":
        last.mkdir()
    if left == "case":
        (last / "case.json").write_text("{}")
    if left == "schema":
        Part(last / "x", COLUMNS, ROW, CASE).close()
        for path in (last / "x").iterdir():
            path.rename(last / path.name)
        (last / "x").rmdir()
    (folder / "case.json").write_text(json.dumps({**CASE, "complete": False, "parts": []}))
    assert repair(folder).rows == 1000
    assert is_truth(load_bundle(folder).columns, range(1000))
    before = content(folder)
    assert repair(folder).changed is False and content(folder) == before


def test_lost_case_of_the_whole_bundle_is_restored(tmp_path):
    folder = record(tmp_path / "run", extra={"changes": [{"tick": 3}]})
    for spoil in (lambda path: path.unlink(), lambda path: path.write_text("{")):
        spoil(folder / "case.json")
        assert "was made again from that of part-0004" in str(repair(folder))
        found = load_bundle(folder).case
        assert found["rows"] == 1700 and found["changes"] == [{"tick": 3}] and "part" not in found


def test_empty_recording_holds_no_rows(tmp_path):
    run = recorder(tmp_path / "run")
    assert run.finish() == tmp_path / "run"
    with pytest.raises(UserError, match="holds no rows"):
        load_bundle(tmp_path / "run")
    with pytest.raises(NoAnswer, match="killed before its first row"):
        repair(tmp_path / "run")


def test_parts_of_two_recordings_are_refused(tmp_path):
    folder = record(tmp_path / "run")
    run = Recorder(tmp_path / "other", COLUMNS[:3], ROW, CASE)
    run.put(make(500, 500))
    shutil.rmtree(folder / "part-0002")
    run.finish().rename(folder / "part-0002")
    with pytest.raises(UserError, match=r"part-0002.* has other columns than"):
        load_bundle(folder)


def test_parts_are_in_the_order_of_their_numbers(tmp_path):
    for number in (1, 2, 10, 9999, 10000):
        (tmp_path / f"part-{number:04d}").mkdir()
    (tmp_path / "part-x").mkdir()
    assert [int(part.name[5:]) for part in part_folders(tmp_path)] == [1, 2, 10, 9999, 10000]
