import errno
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trace_rows import CASE, COLUMNS, ROW, is_truth, make

from rtctl.config.errors import NoAnswer, UserError
from rtctl.trace import repair as repair_module
from rtctl.trace.bundle import load_bundle, save_case
from rtctl.trace.recorder import Recorder
from rtctl.trace.repair import repair
from rtctl.trace.stream import StreamWriter

SIZES = [1, 40, 7, 300, 2]


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Bytes of a complete stream, offset of the end of its schema, offsets of the ends of its batches."""
    path = tmp_path_factory.mktemp("whole") / "recording.arrows"
    writer = StreamWriter(path, COLUMNS, ROW, {"case": json.dumps(CASE)})
    head, ends = writer.bytes, []
    for size in SIZES:
        writer.write(make(writer.rows, size))
        ends.append(writer.bytes)
    writer.close()
    return path.read_bytes(), head, ends


def killed(folder: Path, stream: bytes, case: bytes | None = json.dumps(CASE).encode()) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "recording.arrows").write_bytes(stream)
    if case is not None:
        (folder / "case.json").write_bytes(case)
    return folder


def check_cut(folder: Path, recording, cut: int) -> None:
    stream, head, ends = recording
    killed(folder, stream[:cut])
    if cut < head:
        with pytest.raises(NoAnswer, match="ends before its list of columns"):
            repair(folder)
        assert (folder / "recording.arrows").stat().st_size == cut
        return
    report = repair(folder)
    rows = sum(size for size, end in zip(SIZES, ends, strict=True) if end <= cut)
    assert (report.rows, report.changed) == (rows, True)
    whole = max((end for end in [head, *ends, len(stream)] if end <= cut), default=0)
    assert report.discarded_bytes == cut - whole
    case = json.loads((folder / "case.json").read_text())
    assert case["repaired"] is True and case["rows"] == rows and case["discarded_bytes"] == cut - whole
    if rows:
        assert is_truth(load_bundle(folder).columns, range(rows))
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert sorted(before) == ["case.json", "recording.parquet"]
    again = repair(folder)
    assert again == report._replace(changed=False) and "nothing to repair" in str(again)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_cut_at_or_near_any_boundary_gives_all_complete_batches(tmp_path, recording):
    stream, head, ends = recording
    near = {end + by for end in [0, head, *ends, len(stream)] for by in (-9, -8, -1, 0, 1, 3, 4, 7, 8, 9)}
    for cut in sorted(c for c in near if 0 <= c <= len(stream)):
        check_cut(tmp_path / str(cut), recording, cut)


@settings(deadline=None, max_examples=40)
@given(share=st.floats(0, 1))
def test_stream_cut_anywhere_gives_a_prefix(tmp_path_factory, recording, share):
    check_cut(tmp_path_factory.mktemp("cut"), recording, round(share * len(recording[0])))


def test_zeros_after_the_last_batch_are_not_rows(tmp_path, recording):
    stream, _, ends = recording
    folder = killed(tmp_path / "run", stream[: ends[2]] + bytes(4096))
    assert repair(folder)[1:3] == (sum(SIZES[:3]), 4096)
    assert is_truth(load_bundle(folder).columns, range(sum(SIZES[:3])))


def test_message_that_declares_more_rows_than_it_holds_is_incomplete(tmp_path, recording):
    stream, _, ends = recording
    begin = ends[2]  # message of 300 rows; its header contains its length
    where = stream.index((300).to_bytes(8, "little"), begin)
    folder = killed(tmp_path / "run", stream[:where] + (3000).to_bytes(8, "little") + stream[where + 8 :])
    assert repair(folder).rows == sum(SIZES[:3])
    assert is_truth(load_bundle(folder).columns, range(sum(SIZES[:3])))


def test_column_names_that_are_not_text_are_refused(tmp_path, recording):
    stream, head, _ = recording
    folder = killed(
        tmp_path / "run", stream[:head].replace(b"\x05\0\0\0state", b"\x05\0\0\0\xff\xfeate") + stream[head:]
    )
    with pytest.raises(NoAnswer, match="ends before its list of columns"):
        repair(folder)


def test_case_that_is_not_valid_json_is_reported(tmp_path, recording):
    folder = killed(tmp_path / "run", recording[0], b'{"format": 1, "sample_rate": NaN}')
    with pytest.raises(UserError, match="holds NaN or Infinity"):
        repair(folder)
    assert (folder / "recording.arrows").exists()


@pytest.mark.parametrize("losses", [[], {"rows": "many"}, {"rows": None, "gaps": 7}])
def test_inconsistent_losses_are_counted_again(tmp_path, recording, losses):
    folder = killed(tmp_path / "run", recording[0], json.dumps({**CASE, "losses": losses}).encode())
    repair(folder)
    assert load_bundle(folder).case["losses"] == {"rows": 0, "gaps": []}


@pytest.mark.parametrize("case", [None, b"", b'{"format": 1, "pla', b"[]"])
def test_lost_case_is_restored_from_the_stream(tmp_path, recording, case):
    folder = killed(tmp_path / "run", recording[0], case)
    report = repair(folder)
    assert "made again from the copy inside the recording" in str(report)
    found = load_bundle(folder)
    assert {k: found.case[k] for k in CASE} == CASE and found.case["repaired"] is True
    if case:
        assert (folder / "case.json.broken").read_bytes() == case
    assert repair(folder).changed is False


def test_case_lost_after_the_end_is_restored(tmp_path, recording):
    folder = killed(tmp_path / "run", recording[0])
    repair(folder)
    (folder / "case.json").unlink()
    report = repair(folder)
    assert report.changed and load_bundle(folder).case["plant"] == "ivu"


def test_recording_without_a_case_lists_the_fields_to_fill_in(tmp_path):
    writer = StreamWriter(tmp_path / "recording.arrows", COLUMNS, ROW)
    writer.write(make(0, 10))
    writer.close()
    assert "fill in plant" in str(repair(tmp_path))
    assert load_bundle(tmp_path).case["rows"] == 10


def test_missing_ticks_are_reported_as_losses(tmp_path):
    writer = StreamWriter(tmp_path / "recording.arrows", COLUMNS, ROW)
    rows = make(0, 100)
    writer.write(np.concatenate([rows[5:20], rows[23:30]]))
    writer.write(rows[40:])
    writer.close()
    save_case(tmp_path, CASE)
    repair(tmp_path)
    assert load_bundle(tmp_path).case["losses"] == {"rows": 13, "gaps": [[20, 3], [30, 10]]}


def test_nearly_finished_recording_keeps_its_case(tmp_path, recording):
    run = Recorder(tmp_path / "run", COLUMNS, ROW, CASE)
    run.put(make(0, sum(SIZES)))
    folder = run.finish()
    before = (folder / "case.json").read_bytes()
    (folder / "recording.arrows").write_bytes(recording[0])  # killed just before the removal of the stream
    (folder / "recording.parquet.tmp").touch()
    assert repair(folder).rows == sum(SIZES)
    assert (folder / "case.json").read_bytes() == before and load_bundle(folder).case["complete"] is True
    assert sorted(p.name for p in folder.iterdir()) == ["case.json", "recording.parquet"]


def test_damaged_stream_never_replaces_a_longer_parquet(tmp_path, recording):
    folder = killed(tmp_path / "run", recording[0])
    repair(folder)
    for cut in (0, recording[2][1]):
        killed(folder, recording[0][:cut])
        assert repair(folder).rows == sum(SIZES)
        assert is_truth(load_bundle(folder).columns, range(sum(SIZES)))


@pytest.mark.parametrize("step", ["write_parquet", "save_case"])
def test_killed_repair_can_be_repeated(tmp_path, recording, monkeypatch, step):
    folder = killed(tmp_path / "run", recording[0][:-20])
    real = getattr(repair_module, step)

    def stop_after(*arguments, **named):
        real(*arguments, **named)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(repair_module, step, stop_after)
        with pytest.raises(KeyboardInterrupt):
            repair(folder)
    assert repair(folder).rows == sum(SIZES[:-1])
    assert load_bundle(folder).case["repaired"] is True
    assert is_truth(load_bundle(folder).columns, range(sum(SIZES[:-1])))


def test_repair_without_disk_space_changes_nothing(tmp_path, recording, small_disk):
    folder = killed(tmp_path / "run", recording[0])
    with small_disk(1000), pytest.raises(OSError):
        repair(folder)
    assert (folder / "recording.arrows").read_bytes() == recording[0]
    assert repair(folder).rows == sum(SIZES)


@pytest.mark.parametrize("name", ["case.json", "recording.parquet"])
def test_temporarily_unreadable_file_is_not_treated_as_damaged(tmp_path, recording, monkeypatch, name):
    """The limit of open files is temporary; case and rows of the recording are intact."""
    folder = killed(tmp_path / "run", recording[0])
    repair(folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    (folder / "recording.arrows").write_bytes(recording[0][: recording[2][1]])  # fewer rows

    where, read = (Path, "read_text") if name == "case.json" else (repair_module.pq, "read_metadata")
    original, calls = getattr(where, read), []

    def refused(*given, **options):
        calls.append(given)
        if len(calls) == 1:
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
        return original(*given, **options)

    with monkeypatch.context() as patch:
        patch.setattr(where, read, refused)
        with pytest.raises((UserError, OSError), match="open files"):
            repair(folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path.name in before} == before


def test_repair_refuses_other_folders_and_running_recordings(tmp_path):
    with pytest.raises(UserError, match="nothing to repair"):
        repair(tmp_path)
    run = Recorder(tmp_path, COLUMNS, ROW, CASE)
    run.put(make(0, 10))
    with pytest.raises(UserError, match="in use"):
        repair(tmp_path)
    assert is_truth(load_bundle(run.finish()).columns, range(10))


RECORD_FOR_EVER = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from trace_rows import CASE, COLUMNS, ROW, make
from rtctl.trace.recorder import Recorder
run, tick = Recorder(Path(sys.argv[1]), COLUMNS, ROW, CASE, max_queued_bytes=100_000), 0
while True:
    run.put(make(tick, 200))
    tick += 200
"""


@pytest.mark.parametrize("size", [20_011, 1_000_003])
def test_killed_recording_is_repaired_to_its_written_rows(tmp_path, size):
    folder, path = tmp_path / "run", tmp_path / "run" / "recording.arrows"
    process = subprocess.Popen([sys.executable, "-c", RECORD_FOR_EVER, folder, Path(__file__).parent])
    try:
        while process.poll() is None and not (path.exists() and path.stat().st_size >= size):
            os.sched_yield()
    finally:
        process.kill()
        process.wait()
    assert process.returncode == -9
    shutil.copytree(folder, tmp_path / "copy")
    report = repair(folder)
    found = load_bundle(folder)
    lost = {t for first, count in found.case["losses"]["gaps"] for t in range(first, first + count)}
    last = int(found.columns["tick"][-1])
    assert is_truth(found.columns, sorted(set(range(last + 1)) - lost))
    assert len(found.columns["t"]) == report.rows == last + 1 - len(lost)
    assert repair(tmp_path / "copy").rows == report.rows
