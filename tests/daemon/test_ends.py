"""Killed supervisors and full disks: children end, the trace is readable, the machine name is free again."""

import contextlib
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from waiting import gone, wait_for

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.daemon.server import default_endpoint
from rtctl.daemon.session import Session
from rtctl.daemon.shared_memory import segment_path
from rtctl.loop import generate
from rtctl.loop.records import layout
from rtctl.loop.ring import Reader
from rtctl.tick.memory import Segment
from rtctl.trace.bundle import load_bundle
from rtctl.trace.recorder import Recorder
from rtctl.trace.repair import repair

# safety limits that do not trip on a busy machine
QUIET = {"safety.missed_ticks": 0, "safety.link_timeout": 5.0, "safety.disagreement": 0.0}
RUN = """
import json, resource, sys
from pathlib import Path
from rtctl import machines
from rtctl.daemon.client import Client
from rtctl.daemon.server import default_endpoint
from rtctl.daemon.session import Session
from rtctl.config.errors import UserError
order = json.loads(sys.argv[1])
if order["limit"]:
    resource.setrlimit(resource.RLIMIT_FSIZE, (order["limit"], order["limit"]))
config = machines.CONFIGS[order["config"]["machine"]].model_validate(order["config"])
try:
    result = Session(config, Path(order["out"]), order["length"]).run()
    print(json.dumps({k: result[k] for k in ("ticks", "state", "rows", "lost_counts")}))
except UserError as error:
    print("UserError:", error)
"""


@pytest.fixture
def process(runtime: Path) -> Iterator[Callable[..., subprocess.Popen]]:
    """A run in a process of its own."""
    made: list[subprocess.Popen] = []

    def start(config: Any, out: Path, length: float | None, limit: int = 0) -> subprocess.Popen:
        data = config.model_dump(mode="json", exclude_unset=True)
        order = {"config": data, "out": str(out), "length": length, "limit": limit}
        made.append(
            subprocess.Popen(
                [sys.executable, "-c", RUN, json.dumps(order)],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        return made[-1]

    yield start
    for each in made:
        each.kill()
        each.communicate()


@pytest.mark.realtime
@pytest.mark.parametrize("link", ["shm", "zmq"])
def test_children_end_with_a_killed_supervisor_and_the_ring_stays_readable(
    config: Callable[..., Any], process: Callable[..., subprocess.Popen], tmp_path: Path, link: str
) -> None:
    from rtctl import machines

    settings = config(mode="real", link=link, set={**QUIET, "record.seconds": 2.0})
    path = segment_path(settings.name)
    supervisor = process(settings, tmp_path / "bundle", None)
    made = generate.generate(machines.build(settings), link)
    shape = layout(made.params, made.tables, made.row, 1000)
    try:
        wait_for(lambda: path.exists() and path.stat().st_size, 60)
        segment = Segment.open(path, shape)
        wait_for(lambda: segment["status"][0]["tick"] > 600, 60)
        status = Client(default_endpoint(settings.name, "command"), timeout=20.0).call
        wait_for(lambda: status("status")["rows"]["recorded"] > 0, 60)
        pids = [int(segment[name][0]["pid"]) for name in ("status", "plant_status")]
        assert not any(map(gone, pids))
        supervisor.send_signal(signal.SIGKILL)
        supervisor.wait()
        wait_for(lambda: all(map(gone, pids)), 30)
        left = Segment.open(path, shape)
        assert left["status"][0]["supervisor_lost"] == 1 and left["status"][0]["ended"] == 1
        ticks = int(left["status"][0]["tick"])
        left["ring"][0]["tail"] = 0
        rows = Reader(left).take()
        assert rows["tick"].tolist() == list(range(max(ticks - 999, 0), ticks))
        outputs = left["outputs"][0]["frame"]
        assert not outputs["ao_codes"].any() and outputs["state"] == 0
    finally:
        path.unlink(missing_ok=True)
    report = repair(tmp_path / "bundle")
    kept = load_bundle(tmp_path / "bundle").columns
    assert 0 < report.rows <= ticks and (kept["tick"] == np.arange(report.rows)).all()


def test_machine_name_of_a_killed_daemon_is_free_again(
    config: Callable[..., Any], process: Callable[..., subprocess.Popen], tmp_path: Path
) -> None:
    settings = config(mode="real", set=QUIET)
    killed = process(settings, tmp_path / "first", None)
    path = segment_path(settings.name)
    wait_for(lambda: path.exists() and path.stat().st_size, 60)
    wait_for(lambda: (tmp_path / "first" / "case.json").exists(), 60)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert path.exists()
    fused = settings.model_copy(update={"loop": settings.loop.model_copy(update={"mode": "fused"})})
    assert Session(fused, tmp_path / "second", 0.1).run()["ticks"] == 50
    assert not path.exists()


def test_full_disk_ends_the_recording_but_not_the_run(
    config: Callable[..., Any], process: Callable[..., subprocess.Popen], tmp_path: Path
) -> None:
    """A limit on the file size emulates the full disk; the segment must fit below the limit."""
    settings = config(set={"record.seconds": 2.0})
    Session(settings, tmp_path / "warm", 0.1).run()
    limit = 3_000_000
    assert sum(d.itemsize * n for d, n in layout_of(settings).values()) < limit
    run = process(settings, tmp_path / "bundle", 60.0, limit)
    out, err = run.communicate(timeout=120)
    result = json.loads(out.splitlines()[-1])
    assert run.returncode == 0, err
    assert result["ticks"] == 30_000 and result["state"] == "running"
    rows = result["rows"]
    assert "File too large" in rows["error"] and rows["lost"] > 0 and rows["recorded"] + rows["lost"] == 30_000
    kept = load_bundle(tmp_path / "bundle")
    assert (kept.columns["tick"] == np.arange(rows["recorded"])).all()
    assert kept.case["complete"] is False and kept.case["losses"]["rows"] == rows["lost"]


def layout_of(config: Any) -> dict[str, Any]:
    from rtctl import machines

    made = generate.generate(machines.build(config), "shm")
    return layout(made.params, made.tables, made.row, 1000)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 64 MB for a recording and a file that fills the rest."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64m", "tmpfs", str(folder)]
    try:
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            pytest.skip("mounting a small file system is not allowed here")
    except FileNotFoundError:
        pytest.skip("there is no mount here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=False)


def test_bundle_that_does_not_fit_on_the_disk_is_reported_and_can_be_repaired(
    runtime: Path, config: Callable[..., Any], small_disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rows fit during the run. Another file fills the disk before the rows become a bundle."""
    out, filler, finish = small_disk / "bundle", small_disk / "filler", Recorder.finish

    def full(self: Recorder, *args: Any) -> Path:
        deadline = time.monotonic() + 60.0
        while self.stats().rows_queued:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with contextlib.suppress(OSError), filler.open("wb", buffering=0) as file:
            while file.write(bytes(4096)):
                pass
        return finish(self, *args)

    monkeypatch.setattr(Recorder, "finish", full)
    with pytest.raises(
        UserError,
        match=r"did not take the recording \(.*No space left on device\); make room, then `rtctl trace repair ",
    ):
        Session(config(set={"record.seconds": 60.0}), out, 60.0).run()
    filler.unlink()
    report = repair(out)
    kept = load_bundle(out).columns
    assert report.rows == 30_000 and (kept["tick"] == np.arange(report.rows)).all()
