"""Recovery of rows from the shared memory of a killed daemon, into its bundle or into a new one."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.cli.main import main
from rtctl.config.errors import UserError
from rtctl.config.isolated import python
from rtctl.daemon import leftover, shared_memory
from rtctl.daemon.lock import MachineLock
from rtctl.daemon.recover import recover
from rtctl.loop import fused
from rtctl.loop.ring import RING
from rtctl.machines.base import Column
from rtctl.tick.memory import Segment
from rtctl.trace.bundle import load_bundle
from rtctl.trace.part import Part
from rtctl.trace.rotation import Rotation

ROW = np.dtype([("tick", "i8"), ("t", "f8"), ("u1", "f8")], align=True)
COLUMNS = (Column("tick", "1", "tick"), Column("t", "s", "clock"), Column("u1", "V", "voltage"))
CASE = {"plant": "ivu", "recorded_at": "2025-01-02T03:04:05+00:00"}
CAPACITY = 100
STATUS = np.dtype([("pid", "i8"), ("ended", "i8")])


def rows(first: int, end: int) -> np.ndarray:
    made = np.zeros(end - first, ROW)
    made["tick"] = np.arange(first, end)
    made["t"], made["u1"] = made["tick"] * 0.002, np.sin(made["tick"])
    return made


@pytest.fixture(autouse=True)
def shm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(shared_memory.VARIABLE, str(tmp_path / "shm"))
    monkeypatch.chdir(tmp_path)
    return shared_memory.shared_folder()


def killed(bundle: Path | None, head: int = 130, recorded: int | None = 90, ended: bool = False) -> Path:
    """Segment of a killed daemon: `head` rows in the ring, `recorded` rows in `bundle`."""
    path = shared_memory.segment_path("ivu")
    segment = Segment.create(path, {"status": (STATUS, 1), "ring": (RING, 1), "rows": (ROW, CAPACITY)})
    segment["status"][0]["ended"] = ended
    for row in rows(0, head):
        segment["rows"][row["tick"] % CAPACITY] = row
    segment["ring"][0]["head"] = head
    shared_memory.describe(segment, COLUMNS, CASE, bundle)
    if bundle is not None and recorded is not None:
        part = Part(bundle, COLUMNS, ROW, {"format": 1, **CASE})
        part.write(rows(0, recorded))
        part._writer._shut()  # killed
    return path


def ticks(folder: Path) -> list[int]:
    found = load_bundle(folder).columns
    assert np.array_equal(found["u1"], np.sin(found["tick"]))
    return [int(tick) for tick in found["tick"]]


def test_unrecorded_rows_are_joined_to_the_bundle(shm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bundle = Path("run").absolute()
    killed(bundle)
    assert main(["trace", "recover", "ivu"]) == 0
    assert capsys.readouterr().out == f"{bundle}: 40 rows recovered, ticks 90 to 129, none is lost\n"
    assert ticks(bundle) == list(range(130))
    case = load_bundle(bundle).case
    assert (case["rows"], case["losses"]["rows"], case["complete"]) == (130, 0, False)
    assert case["recovered"] == {"rows": 40, "ticks": [90, 129]}
    assert list(shm.iterdir()) == []
    with pytest.raises(UserError, match="no rows of a killed 'ivu' are in"):
        recover("ivu")


def test_unrecorded_rows_are_joined_to_a_repaired_bundle() -> None:
    from rtctl.trace.repair import repair

    killed(Path("run").absolute())
    repair("run")
    assert recover("ivu")[0][0].rows == 40 and ticks(Path("run")) == list(range(130))


def test_rows_lost_between_recording_and_ring_are_reported() -> None:
    """The ring has overflowed. Its oldest row may be half overwritten and is not recovered."""
    killed(Path("run").absolute(), head=250, recorded=90)
    done = recover("ivu")[0][0]
    assert (done.rows, done.ticks, done.lost) == (99, (151, 249), 61)
    assert load_bundle("run").case["losses"] == {"rows": 61, "gaps": [[90, 61]]}
    assert ticks(Path("run")) == [*range(90), *range(151, 250)]


def test_ended_loop_leaves_no_torn_row_in_the_ring() -> None:
    killed(None, head=250, ended=True)
    assert recover("ivu", Path("here"))[0][0].ticks == (150, 249)


@pytest.mark.parametrize("why", ["never", "deleted", "another"])
def test_rows_without_a_matching_bundle_make_a_new_one(why: str) -> None:
    bundle = Path("run").absolute()
    killed(None if why == "never" else bundle, recorded=None)
    if why == "another":
        part = Part(bundle, COLUMNS, ROW, {"format": 1, **CASE, "recorded_at": "later"})
        part.write(rows(0, 10))
        part._writer._shut()
    before = {path: path.read_bytes() for path in bundle.iterdir()} if bundle.exists() else {}
    done = recover("ivu")[0][0]
    assert done.bundle is not None and done.bundle.name.startswith("ivu-recovered-") and done.alone
    assert ticks(done.bundle) == list(range(31, 130))
    assert before == ({path: path.read_bytes() for path in bundle.iterdir()} if bundle.exists() else {})


def test_moved_bundle_can_be_given_as_an_argument(tmp_path: Path) -> None:
    killed(tmp_path / "run")
    (tmp_path / "run").rename(tmp_path / "moved")
    assert recover("ivu", tmp_path / "moved")[0][0].bundle == tmp_path / "moved"
    assert ticks(tmp_path / "moved") == list(range(130))


@pytest.mark.parametrize("recorded", [0, None])
def test_all_rows_are_recovered_into_an_empty_bundle(tmp_path: Path, recorded: int | None) -> None:
    killed(tmp_path / "run", head=60, recorded=0)
    if recorded is None:  # killed before the schema was written
        os.truncate(tmp_path / "run" / "recording.arrows", 3)
    assert recover("ivu")[0][0].rows == 60 and ticks(tmp_path / "run") == list(range(60))


def test_recovered_rows_extend_the_last_part_of_a_rotated_bundle(tmp_path: Path) -> None:
    from rtctl.trace.recorder import Recorder

    run = Recorder(tmp_path / "run", COLUMNS, ROW, CASE, rotation=Rotation(minutes=0.1 / 60))  # 50 rows
    run.put(rows(0, 90))
    with run._changed:
        run._closing = True
        run._changed.notify_all()
    run._thread.join()
    run._bundle._part._writer._shut()  # type: ignore[union-attr]
    run._bundle._full.put(None)  # type: ignore[union-attr]
    run._bundle._thread.join()  # type: ignore[union-attr]
    run._bundle._unlock()  # type: ignore[union-attr]
    killed(tmp_path / "run", recorded=None)
    assert recover("ivu")[0][0].ticks == (90, 129)
    assert ticks(tmp_path / "run") == list(range(130))
    case = load_bundle(tmp_path / "run").case
    assert [part["rows"] for part in case["parts"]] == [50, 80] and case["rows"] == 130


def test_segment_is_kept_when_the_disk_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = killed(tmp_path / "run")
    with monkeypatch.context() as patch:
        patch.setattr("rtctl.trace.join.write", lambda *_, **__: (_ for _ in ()).throw(OSError(28, "No space left")))
        done, troubles = recover("ivu")
    assert done == [] and "No space left" in troubles[0] and not path.exists()
    assert len(shared_memory.kept("ivu")) == 1 and recover("ivu")[0][0].rows == 40


def test_running_daemon_keeps_its_segment_while_older_segments_are_recovered(tmp_path: Path) -> None:
    killed(tmp_path / "first")
    shared_memory.put_aside("ivu")
    path = killed(tmp_path / "second")
    script = "import sys; from pathlib import Path; from rtctl.daemon.lock import MachineLock\n"
    script += "with MachineLock(Path(sys.argv[1]), 'ivu'): print('held', flush=True); sys.stdin.read()"
    lock = str(shared_memory.lock_path("ivu"))
    with subprocess.Popen(python("-c", script, lock), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None and other.stdout.readline() == b"held\n"
        assert [each.bundle for each in recover("ivu")[0]] == [tmp_path / "first"]
        with pytest.raises(UserError, match=rf"is run by another daemon \(pid {other.pid}"):
            recover("ivu")
        other.communicate()
    assert path.exists() and recover("ivu")[0][0].bundle == tmp_path / "second"


def test_recovery_waits_for_a_running_loop_and_then_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leftover, "ENDING", 0.05)
    killed(tmp_path / "run")
    shared_memory.put_aside("ivu")
    loop = subprocess.Popen([sys.executable, "-c", "input()", "loop_process"], stdin=subprocess.PIPE)
    path = shared_memory.kept("ivu")[0]
    with path.open("r+b") as file:
        file.write(np.int64(loop.pid).tobytes())
    try:
        assert f"(pid {loop.pid}) still runs" in recover("ivu")[1][0] and path.exists()
    finally:
        loop.communicate(b"\n")
    assert recover("ivu")[0][0].rows == 40


@pytest.mark.parametrize("name", ["../ivu", "*", ""])
def test_machine_name_that_is_a_path_is_refused(name: str) -> None:
    with pytest.raises(UserError, match="is no name of a machine"):
        recover(name)


RUN = """
import json, os, sys, time
from pathlib import Path
from rtctl import machines
from rtctl.daemon.supervisor import Supervisor
order = json.loads(sys.argv[1])
config = machines.CONFIGS["ivu"].model_validate(order["config"])
supervisor = Supervisor(config, Path(order["out"]))
supervisor.armed_at_start = True
with supervisor:
    ring, room = supervisor.segment["ring"][0], len(supervisor.segment["rows"]) - 1
    def fill():
        while ring["head"] - ring["tail"] < room:  # where virtual time waits for its reader
            time.sleep(0.001)
    fill()
    supervisor.turn()
    while supervisor.recorder.stats().rows_queued:
        time.sleep(0.001)
    fill()
    os.write(1, b"!")
    os.read(0, 1)  # until it is killed
"""


def test_kill_of_the_process_group_loses_no_row(runtime: Path, config: Callable[..., Any], tmp_path: Path) -> None:
    settings = config(set={"record.seconds": 2.0})
    data = {"config": settings.model_dump(mode="json", exclude_unset=True), "out": str(tmp_path / "run")}
    child = subprocess.Popen(
        [sys.executable, "-c", RUN, json.dumps(data)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip
    try:
        assert child.stdout is not None and child.stdout.read(1) == b"!"
    finally:
        os.killpg(child.pid, signal.SIGKILL)
        child.communicate()
    done, troubles = recover(settings.name)
    assert not troubles and (done[0].rows, done[0].lost) == (999, 0)
    found = load_bundle(tmp_path / "run").columns
    count = len(found["tick"])
    assert (found["tick"] == np.arange(count)).all()
    truth = fused.run(settings, count / 500).rows
    for name in set(found) - {"order"}:
        np.testing.assert_array_equal(found[name], truth[name][:count], err_msg=name)


def test_machine_lock_is_free_during_recovery(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A service that restarts at once is not refused."""
    from rtctl.trace import join

    killed(tmp_path / "run")
    held, write = [], join.write

    def slow(*args: Any, **words: Any) -> int:
        with MachineLock(shared_memory.lock_path("ivu"), "ivu"):
            held.append(True)
        return write(*args, **words)

    monkeypatch.setattr(join, "write", slow)
    assert recover("ivu")[0][0].rows == 40 and held == [True]
