"""Injected process faults: exact tick on virtual time, and full cleanup afterwards."""

import ast
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import gone, wait_for

import rtctl
from rtctl.config.errors import UserError
from rtctl.daemon.faults import BUSY
from rtctl.daemon.supervisor import Supervisor
from rtctl.faults import processes
from rtctl.faults.cases import STANDS
from rtctl.trace.bundle import load_bundle


def test_faults_are_added_listed_and_cleared(runtime: Path, config: Callable[..., Any]) -> None:
    settings = config(set={"faults": [{"fault": "link.silent", "at": 1e5}]})
    with Supervisor(settings, None, 100) as supervisor:
        handle = supervisor.faults.handle
        added = handle("add", {"fault": "encoder.freeze", "lasts": 50.0})
        assert [f["fault"] for f in added["faults"]] == ["link.silent", "encoder.freeze"]
        assert added["faults"][1]["end"] - added["faults"][1]["begin"] == 25_000
        assert handle("add", {"fault": "clock.step", "at": 1e5})["faults"][2]["fault"] == "clock.step"
        assert handle("clear", None)["faults"] == [] == handle("list", None)["faults"]
        for _ in supervisor.run():
            pass


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"fault": "plant.kill"}, "inside the loop"),
        ({"fault": "disk.full"}, "records nothing"),
        ({"fault": "link.loss", "size": 2.0}, "0 to 1 is possible"),
        ({"fault": "encoder.feeze"}, "encoder.freeze"),
        ({"fault": "link.delay", "size": 2.0, "extra": 1}, "extra"),
    ],
)
def test_invalid_fault_is_refused(
    runtime: Path, config: Callable[..., Any], wanted: dict[str, Any], words: str
) -> None:
    with Supervisor(config(), None, 10) as supervisor, pytest.raises(UserError, match=words):
        supervisor.faults.handle("add", wanted)


def test_rows_lost_by_a_stalled_recorder_are_counted_exactly(
    runtime: Path, config: Callable[..., Any], tmp_path: Path
) -> None:
    ticks = 4000
    settings = config(set={"faults": [{"fault": "recorder.stall", "at": 2.0, "lasts": 4.0}], "record.seconds": 2.0})
    with Supervisor(settings, tmp_path / "bundle", ticks) as supervisor:
        assert supervisor.recorder is not None
        supervisor.recorder._most = 300 * supervisor.made.row.itemsize
        for _ in supervisor.run():
            pass
        supervisor.stop()
        supervisor.finish()
        found = supervisor.snapshot()
    kept = load_bundle(tmp_path / "bundle")
    missing = np.setdiff1d(np.arange(ticks), kept.columns["tick"])
    gaps = [np.arange(first, first + count) for first, count in kept.case["losses"]["gaps"]]
    assert [f["tick"] for f in found["faults"]] == [1000, 3000]
    assert found["rows"]["recorded"] + found["rows"]["lost"] == ticks and found["rows"]["lost"] >= 1700
    assert np.array_equal(np.concatenate(gaps), missing)


def test_run_that_ends_during_a_recorder_stall_keeps_all_rows(
    runtime: Path, config: Callable[..., Any], tmp_path: Path
) -> None:
    settings = config(set={"faults": [{"fault": "recorder.stall", "at": 1.0}, {"fault": "cpu.hog", "size": 1}]})
    with Supervisor(settings, tmp_path / "bundle", 1000) as supervisor:
        for _ in supervisor.run():
            pass
        supervisor.stop()
        supervisor.finish()
    assert len(load_bundle(tmp_path / "bundle").columns["tick"]) == 1000


# CPU hogs


def test_cpu_hog_ends_with_its_parent_also_after_sigkill() -> None:
    text = f"import subprocess, sys, time; p = subprocess.Popen([sys.executable, '-S', '-c', {BUSY!r}], " \
           "stdin=subprocess.PIPE); print(p.pid, flush=True); time.sleep(100)"  # fmt: skip
    with subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        hog = int(parent.stdout.readline())
        assert not gone(hog)
        os.kill(parent.pid, signal.SIGKILL)
    wait_for(lambda: gone(hog))


# the wall clock


ALLOWED = {  # modules that write dates
    "daemon/captures.py": {"now"}, "trace/recorder.py": {"now"}, "trace/rotation.py": {"now"}, "cli/common.py": {"now"},
}  # fmt: skip


def wall_clock(path: Path) -> set[str]:
    """Calls that read the wall clock: time.time, time.time_ns, datetime.now and the like."""
    names = {("time", "time"), ("time", "time_ns"), ("time", "localtime"), ("datetime", "now"), ("datetime", "utcnow")}
    calls = [n.func for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Call)]
    found = [(f.value, f.attr) for f in calls if isinstance(f, ast.Attribute)]
    return {a for v, a in found if isinstance(v, ast.Name) and (v.id, a) in names}


@pytest.mark.parametrize("folder", ["loop", "daemon", "trace", "laws", "machines"])
def test_only_dates_depend_on_the_wall_clock(folder: str) -> None:
    root = Path(rtctl.__file__).parent
    for path in (root / folder).rglob("*.py"):
        where = path.relative_to(root).as_posix()
        assert wall_clock(path) <= ALLOWED.get(where, set()), where


def test_clock_step_fault_restores_the_clock_afterwards(runtime: Path, config: Callable[..., Any]) -> None:
    settings = config(set={"faults": [{"fault": "clock.step", "at": 0.1, "lasts": 0.1, "size": -1e6}]})
    before = time.time
    with Supervisor(settings, None, 200) as supervisor:
        seen = [time.time() for _ in supervisor.run()]
        supervisor.stop()
    assert time.time is before and abs(time.time() - seen[-1]) < 1e5
    assert [f["what"] for f in supervisor.faults.told] == ["begins", "has passed"]


# the plant


@pytest.mark.realtime
def test_killed_plant_reconnects_over_zmq(runtime: Path, tmp_path: Path) -> None:
    assert processes.plant_back(STANDS["ivu"], tmp_path, "zmq").ok
