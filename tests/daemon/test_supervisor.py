"""Supervisor with a running machine: refused starts, and replies to commands."""

import os
import signal
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
from rtctl.daemon.shared_memory import segment_path
from rtctl.daemon.supervisor import Supervisor
from rtctl.trace.bundle import load_bundle

# safety limits that do not trip on a busy machine
QUIET = {"safety.missed_ticks": 0, "safety.link_timeout": 5.0, "safety.disagreement": 0.0}
STUCK = {
    "plant.parameters": {"R1": 0.038, "R2": 0.022, "tau_F1": 9.0, "tau_F2": 9.0, "tau_Fc": 9.0},
    "safety.following_error": 0.0, "safety.frozen_time": 0.0, "safety.current_time": 0.0,
}  # fmt: skip


class Live:
    """A supervisor that runs in a thread, with a client of its command socket."""

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


# refused starts


def test_second_daemon_of_the_same_name_is_refused_with_the_pid(live: Callable[..., Live], tmp_path: Path) -> None:
    first = live()
    with (
        pytest.raises(
            UserError,
            match=rf"is run by another daemon \(pid {os.getpid()}, its sockets are in .*\); stop it with `rtctl stop",
        ),
        Supervisor(first.of.config, tmp_path / "second"),
    ):
        pass
    assert first.call("status")["ticks"] > 0  # the first daemon still runs
    assert segment_path(first.of.config.name).exists() and not (tmp_path / "second").exists()


def test_missing_plant_is_an_error_after_the_link_timeout(
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
    assert not segment_path(settings.name).exists() and not (tmp_path / "bundle").exists()  # nothing is left behind


def test_output_folder_with_a_recording_is_refused(runtime: Path, config: Callable[..., Any], tmp_path: Path) -> None:
    settings = config()
    Session(settings, tmp_path / "bundle", 0.1).run()
    with pytest.raises(UserError, match=r"already holds recording\.parquet; choose another folder"):
        Session(settings, tmp_path / "bundle", 0.1).run()
    assert not segment_path(settings.name).exists()


# replies to commands


@pytest.mark.realtime
def test_armed_machine_follows_a_setpoint_and_stops(live: Callable[..., Live]) -> None:
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
    assert not outputs["ao_codes"].any() and outputs["state"] == 0  # the last frame sent to the plant
    assert machine.of.segment["plant_status"][0]["ended"] in (0, 1)


@pytest.mark.realtime
def test_disarm_switches_the_outputs_off(live: Callable[..., Live]) -> None:
    machine = live()
    machine.call("arm")
    machine.in_state("running")
    machine.call("disarm")
    machine.in_state("idle")
    trace = machine.end()
    off = np.flatnonzero(trace["state"] == 2)[-1] + 1
    assert trace["u1"][off - 1] > 0 and not trace["u1"][off:].any() and not trace["u2"][off:].any()


@pytest.mark.realtime
def test_gain_change_is_bumpless(live: Callable[..., Live]) -> None:
    """The machine is held, so the error stays. Without bumpless transfer the command would jump by 1.1 V."""
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


def test_setting_that_cannot_change_while_running_is_refused(live: Callable[..., Live]) -> None:
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
def test_capture_contains_the_rows_around_its_trigger(live: Callable[..., Live], tmp_path: Path) -> None:
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


def test_killed_loop_is_a_failure_recorded_in_the_bundle(live: Callable[..., Live]) -> None:
    machine = live()
    os.kill(machine.of.loop.pid, signal.SIGKILL)
    machine.thread.join(10)
    assert machine.error is None and "the loop's process died" in str(machine.of.failure)
    folder = machine.of.finish()
    assert folder is not None and load_bundle(folder).case["run"]["failure"] == str(machine.of.failure)
