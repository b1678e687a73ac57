"""The supervisor with a running machine: who may start it, what it answers, and what is left when something dies."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client, CommandError
from rtctl.daemon.server import default_endpoint
from rtctl.daemon.session import Session
from rtctl.daemon.supervisor import SHM, Supervisor
from rtctl.loop import generate
from rtctl.loop.memory import Segment
from rtctl.loop.records import layout
from rtctl.loop.ring import Reader
from rtctl.trace.bundle import load_bundle
from rtctl.trace.repair import repair

QUIET = {"safety.missed_ticks": 0, "safety.link_timeout": 5.0}  # a busy test machine is no reason to trip
STUCK = {
    "plant.parameters": {"R1": 0.038, "R2": 0.022, "tau_F1": 9.0, "tau_F2": 9.0, "tau_Fc": 9.0},
    "safety.following_error": 0.0, "safety.frozen_time": 0.0, "safety.current_time": 0.0,
}  # fmt: skip
RUN = """
import json, resource, sys
from pathlib import Path
from rtctl import machines
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


def segment_path(config: Any) -> Path:
    return SHM / f"rtctl-{os.getuid()}-{config.name}"


class Live:
    """A supervisor whose turns are taken in a thread, with a client of its command socket."""

    def __init__(self, supervisor: Supervisor):
        self.of = supervisor
        self.call = Client(default_endpoint(supervisor.config.name, "command"), timeout=5.0).call
        self.error: BaseException | None = None
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self) -> None:
        try:
            for _ in self.of.run():
                pass
        except BaseException as error:
            self.error = error

    def until(self, what: Callable[[], Any], seconds: float = 10.0) -> Any:
        deadline = time.monotonic() + seconds
        while not what():
            assert time.monotonic() < deadline and self.error is None, self.error
            time.sleep(0.005)
        return what()

    def in_state(self, state: str) -> None:
        self.until(lambda: self.call("status")["state"] == state)

    def end(self) -> dict[str, np.ndarray]:
        """Stop through the command socket; returns the trace."""
        self.call("stop")
        self.thread.join(10)
        assert not self.thread.is_alive() and self.error is None
        self.of.stop()
        folder = self.of.finish()
        assert folder is not None
        return load_bundle(folder).columns


@pytest.fixture
def live(runtime: Path, config: Callable[..., Any], tmp_path: Path) -> Iterator[Callable[..., Live]]:
    """`live(set={...})` starts a machine in real mode; at the end of the test it is stopped."""
    made: list[Live] = []

    def start(link: str = "shm", **keys: Any) -> Live:
        supervisor = Supervisor(config(mode="real", link=link, set={**QUIET, **keys}), tmp_path / "bundle")
        supervisor.__enter__()
        made.append(Live(supervisor))
        return made[-1]

    yield start
    for each in made:
        each.of.status["stop"] = 1
        each.thread.join(10)
        each.of.__exit__()


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


# who may start it


def test_a_second_daemon_of_that_name_is_refused_with_the_pid(live: Callable[..., Live], tmp_path: Path) -> None:
    first = live()
    with (
        pytest.raises(UserError, match=rf"is run by another daemon \(pid {os.getpid()}\); stop it with `rtctl stop"),
        Supervisor(first.of.config, tmp_path / "second"),
    ):
        pass
    assert first.call("status")["ticks"] > 0  # and the first runs on
    assert segment_path(first.of.config).exists() and not (tmp_path / "second").exists()


def test_a_plant_that_does_not_answer_is_told_within_its_time(
    runtime: Path, config: Callable[..., Any], tmp_path: Path
) -> None:
    keys = {"link.endpoint": f"ipc://{tmp_path}/nobody", "link.timeout": 0.5}
    settings = config(mode="real", link="zmq", set=keys)
    with (
        pytest.raises(
            UserError, match=r"no plant answers at ipc://.* within 0\.5 s \(link\.timeout\); start it with `rtctl plant"
        ),
        Supervisor(settings, tmp_path / "bundle"),
    ):
        pass
    assert not segment_path(settings).exists()  # nothing is left behind


def test_a_folder_that_is_taken_is_refused(runtime: Path, config: Callable[..., Any], tmp_path: Path) -> None:
    settings = config()
    Session(settings, tmp_path / "bundle", 0.1).run()
    with pytest.raises(UserError, match=r"already holds recording\.parquet; choose another folder"):
        Session(settings, tmp_path / "bundle", 0.1).run()
    assert not segment_path(settings).exists()


# what it answers


@pytest.mark.realtime
def test_arm_setpoint_stop(live: Callable[..., Live]) -> None:
    machine = live()
    assert machine.call("status")["state"] == "idle"
    with pytest.raises(CommandError, match="outputs are off; `rtctl arm` first"):
        machine.call("setpoint", value=0.1)
    machine.call("arm")
    machine.in_state("running")
    answer = machine.call("setpoint", value=2.5, unit="mm", ramp=5.0, ramp_unit="mm/s")
    assert answer["target"] == pytest.approx(0.2) and answer["rate"] == pytest.approx(0.4)
    machine.until(lambda: abs(machine.call("status")["signals"]["capstan"] - 0.2) < 0.02)
    trace = machine.end()
    assert machine.of.snapshot()["trip"] is None
    assert (trace["tick"] == np.arange(len(trace["tick"]))).all()
    outputs = machine.of.segment["outputs"][0]["frame"]
    assert not outputs["ao_codes"].any() and outputs["state"] == 0  # the last frame that the plant was sent
    assert machine.of.segment["plant_status"][0]["ended"] in (0, 1)


@pytest.mark.realtime
def test_the_outputs_go_off_with_disarm(live: Callable[..., Live]) -> None:
    machine = live()
    machine.call("arm")
    machine.in_state("running")
    machine.call("disarm")
    machine.in_state("idle")
    trace = machine.end()
    off = np.flatnonzero(trace["state"] == 2)[-1] + 1
    assert trace["u1"][off - 1] > 0 and not trace["u1"][off:].any() and not trace["u2"][off:].any()


@pytest.mark.realtime
def test_a_gain_changes_without_a_jump(live: Callable[..., Live]) -> None:
    """The machine is held, so that the error stays: without the transfer the command would jump by 1.1 V."""
    machine = live(**STUCK)
    machine.call("arm")
    machine.in_state("running")
    machine.call("setpoint", value=0.1)
    machine.until(lambda: abs(machine.call("status")["signals"]["capstan_error"] - 0.1) < 2e-3)
    time.sleep(0.3)  # the derivative has died out
    assert machine.call("set", path="law.position.gain", value="20 V/rad")["value"] == "20 V/rad"
    assert machine.call("get", path="law.position.gain")["value"] == 20.0
    time.sleep(1.0)
    trace = machine.end()
    (change,) = machine.of.changes
    assert change["path"] == "law.position.gain"
    k = change["tick"]
    after = trace["u_c"][k - 5 :]
    assert np.abs(np.diff(after)).max() < 0.05
    assert after[0] - after[-1] == pytest.approx(1.1, rel=0.1)
    assert abs(trace["capstan_error"][-1]) > 0.09


def test_what_cannot_change_while_running_is_refused(live: Callable[..., Live]) -> None:
    machine = live()
    gain = machine.call("get", path="law.position.gain")["value"]
    for path, value, words in [
        ("loop.rate", 100.0, "cannot change while the machine runs"),
        ("plant.physics", [], "cannot change while the machine runs"),
        ("law.position.gain", "3 kg", "gain"),
        ("law.position.gian", 3.0, "gian"),
        ("safety.tension_min", 1e10, "tension_min"),
    ]:
        with pytest.raises(CommandError, match=words) as refused:
            machine.call("set", path=path, value=value)
        assert refused.value.code == "refused"
    assert machine.call("get", path="law.position.gain")["value"] == gain and machine.of.changes == []


@pytest.mark.realtime
def test_malformed_messages_do_not_disturb_the_loop(live: Callable[..., Live]) -> None:
    machine = live()
    machine.call("arm")
    machine.in_state("running")
    context = zmq.Context()
    socket = context.socket(zmq.DEALER)
    socket.connect(default_endpoint(machine.of.config.name, "command"))
    noise = np.random.default_rng(1)
    for n in range(300):
        socket.send_multipart([noise.bytes(int(noise.integers(0, 400))) for _ in range(1 + n % 4)])
    machine.until(lambda: sum(machine.of.server.refused.values()) >= 290)
    context.destroy(linger=0)
    ticks = machine.call("status")["ticks"]
    machine.until(lambda: machine.call("status")["ticks"] > ticks + 50)
    status = machine.call("status")
    assert status["state"] == "running" and status["rows"]["lost_in_ring"] == 0
    trace = machine.end()
    assert (np.diff(trace["tick"]) == 1).all()


@pytest.mark.realtime
def test_a_capture_has_the_rows_around_its_trigger(live: Callable[..., Live], tmp_path: Path) -> None:
    machine = live()
    machine.call("arm")
    machine.in_state("running")
    out = tmp_path / "capture"
    given = machine.call("capture", seconds=0.2, pre=0.1, trigger="target > 0.05", out=str(out))
    assert not given["done"] and not given["triggered"]
    machine.call("setpoint", value=0.2)
    done = machine.until(lambda: (s := machine.call("capture_status", id=given["id"]))["done"] and s)
    assert done["triggered"] and done["rows"] == 100
    rows = load_bundle(out).columns
    assert (np.diff(rows["tick"]) == 1).all() and len(rows["tick"]) == 100
    assert (rows["target"][:50] <= 0.05).all() and (rows["target"][50:] > 0.05).all()
    trace = machine.end()
    here = slice(int(rows["tick"][0]), int(rows["tick"][-1]) + 1)
    assert all(np.array_equal(rows[n], trace[n][here], equal_nan=True) for n in trace)


# what is left when something dies


def gone(pid: int) -> bool:
    """Whether a process has ended; one that waits to be reaped has."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def wait_for(what: Callable[[], Any], seconds: float) -> Any:
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "it did not come about"
        time.sleep(0.01)
    return what()


@pytest.mark.realtime
@pytest.mark.parametrize("link", ["shm", "zmq"])
def test_children_end_with_their_supervisor_and_the_last_seconds_can_be_read(
    config: Callable[..., Any], process: Callable[..., subprocess.Popen], tmp_path: Path, link: str
) -> None:
    from rtctl import machines

    settings = config(mode="real", link=link, set={**QUIET, "record.seconds": 2.0})
    path = segment_path(settings)
    supervisor = process(settings, tmp_path / "bundle", None)
    made = generate.generate(machines.build(settings), link)
    shape = layout(made.params, made.tables, made.row, 1000)
    try:
        wait_for(path.exists, 20)
        segment = Segment.open(path, shape)
        wait_for(lambda: segment["status"][0]["tick"] > 600, 60)
        pids = [int(segment[name][0]["pid"]) for name in ("status", "plant_status")]
        assert not any(map(gone, pids))
        supervisor.send_signal(signal.SIGKILL)
        supervisor.wait()
        wait_for(lambda: all(map(gone, pids)), 5)
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


def test_a_name_whose_daemon_was_killed_is_free_again(
    config: Callable[..., Any], process: Callable[..., subprocess.Popen], tmp_path: Path
) -> None:
    settings = config(mode="real", set=QUIET)
    killed = process(settings, tmp_path / "first", None)
    path = segment_path(settings)
    wait_for(path.exists, 20)
    wait_for(lambda: (tmp_path / "first" / "case.json").exists(), 20)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert path.exists()
    fused = settings.model_copy(update={"loop": settings.loop.model_copy(update={"mode": "fused"})})
    assert Session(fused, tmp_path / "second", 0.1).run()["ticks"] == 50
    assert not path.exists()


def test_the_loop_that_dies_is_an_error_with_its_last_words(live: Callable[..., Live]) -> None:
    machine = live()
    os.kill(machine.of.loop.pid, signal.SIGKILL)
    machine.thread.join(10)
    assert isinstance(machine.error, RuntimeError) and "the loop's process died" in str(machine.error)


def test_a_full_disk_ends_the_recording_and_not_the_run(
    config: Callable[..., Any], process: Callable[..., subprocess.Popen], tmp_path: Path
) -> None:
    """A limit on the size of files stands in for the disk; the segment must fit below it."""
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
    """A file system of four megabytes."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", str(folder)]
    try:
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            pytest.skip("mounting a small file system is not allowed here")
    except FileNotFoundError:
        pytest.skip("there is no mount here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=False)


def test_a_disk_without_room_for_the_bundle_is_told_and_repaired_once_there_is(
    runtime: Path, config: Callable[..., Any], small_disk: Path
) -> None:
    out = small_disk / "bundle"
    with pytest.raises(
        UserError,
        match=r"did not take the recording \(.*No space left on device\); make room, then `rtctl trace repair ",
    ):
        Session(config(set={"record.seconds": 2.0}), out, 60.0).run()
    subprocess.run(["mount", "-o", "remount,size=20m", str(small_disk)], check=True)
    report = repair(out)
    kept = load_bundle(out).columns
    assert 1000 < report.rows < 30_000 and (kept["tick"] == np.arange(report.rows)).all()
