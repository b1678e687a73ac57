"""Loop and plant on two hosts: bit-exact with one process on virtual time, and a trip when the cable is cut."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.daemon.keys import new_keys
from rtctl.loop import generate
from rtctl.tick import frames
from rtctl.trace.bundle import load_bundle

from .netns import PLANT, Host, NotHereError, TwoHosts, number

ENDPOINT = f"tcp://{PLANT}:5570"
RTCTL = (sys.executable, "-m", "rtctl.cli.main")
SECONDS = 0.6  # of virtual time
PATIENT = {
    "loop.realtime": "off", "safety.missed_ticks": 0, "safety.following_error": 0, "safety.frozen_time": 0,
    "safety.link_timeout": 0.5,
}  # fmt: skip


@pytest.fixture(scope="module")
def cable() -> Iterator[TwoHosts]:
    try:
        with TwoHosts() as cable:
            yield cable
    except NotHereError as reason:
        pytest.skip(str(reason))


class Bench:
    """Both hosts with exchanged keys, and the processes started on them."""

    def __init__(self, cable: TwoHosts, folder: Path):
        self.name = f"two{os.getpid()}"
        self.cable, self.folder = cable, folder
        self.loop, self.plant = Host(cable.loop, folder / "loop"), Host(cable.plant, folder / "plant")
        self.started: list[subprocess.Popen[str]] = []
        for host, pair in ((self.loop, "client"), (self.plant, "server")):
            new_keys(pair, host.keys)
        self.give(self.loop.keys / "client.key", self.plant.keys / "authorized")
        self.give(self.plant.keys / "server.key", self.loop.keys)

    @staticmethod
    def give(key: Path, folder: Path) -> None:
        (folder / key.name).write_bytes(key.read_bytes())

    def start(self, host: Host, *words: Any) -> subprocess.Popen[str]:
        self.started.append(host.popen(*RTCTL, *map(str, words)))
        return self.started[-1]

    def start_plant(self, mode: str, **more: Any) -> subprocess.Popen[str]:
        """Start the plant on its host; returns when the plant listens."""
        keys = {"name": self.name, "link.keys": "client", **more}
        process = self.start(self.plant, "plant", "ivu", "--mode", mode, "--endpoint", ENDPOINT, *sets(keys))
        assert process.stdout is not None and process.stderr is not None
        assert "listens" in process.stdout.readline(), process.stderr.read()
        return process

    def start_loop(self, mode: str, *words: str, **more: Any) -> subprocess.Popen[str]:
        keys = {"name": self.name, "link.plant": "external", "link.endpoint": ENDPOINT, "link.keys": "client"}
        out = self.folder / "bundle"
        fixed = ("run", "ivu", "--mode", mode, "--link", "zmq", "--json", "--no-plot", "--out", out)
        return self.start(self.loop, *fixed, *words, *sets({**keys, **more}))

    def end(self, process: subprocess.Popen[str]) -> tuple[int, str, str]:
        """Wait for a process; returns exit code, stdout and stderr."""
        out, err = process.communicate(timeout=100)
        return process.returncode, out, err

    def close(self) -> None:
        for process in self.started:
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        for process in self.started:
            try:
                process.communicate(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()


def sets(keys: dict[str, Any]) -> list[str]:
    return [word for path, value in keys.items() for word in ("--set", f"{path}={value}")]


@pytest.fixture
def bench(cable: TwoHosts, runtime: Path) -> Iterator[Bench]:
    cable.shape()
    folder = runtime / f"two{next(number)}"  # not tmp_path: a socket's path has 107 bytes at most
    made = Bench(cable, folder)
    try:
        yield made
    finally:
        made.close()


def until(what: Callable[[], Any], of: subprocess.Popen[str], seconds: float = 60.0) -> Any:
    deadline = time.monotonic() + seconds
    while not (found := what()):
        assert of.poll() is None, of.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return found


@pytest.fixture(scope="module")
def fused(runtime: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """The same run in one process."""
    out = tmp_path_factory.mktemp("fused") / "bundle"
    command = [*RTCTL, "run", "ivu", "--mode", "fused", "--for", f"{SECONDS}s", "--no-plot", "--out", str(out)]
    subprocess.run([*command, *sets({"name": f"fused{os.getpid()}"})], check=True, capture_output=True)
    return load_bundle(out).columns


@pytest.mark.parametrize("delay", [0.0, 1e-3])
def test_lockstep_over_the_network_is_bit_exact_with_fused(
    bench: Bench, fused: dict[str, np.ndarray], delay: float
) -> None:
    bench.cable.shape(delay=delay)
    bench.start_plant("lockstep")
    code, _, err = bench.end(bench.start_loop("lockstep", "--for", f"{SECONDS}s"))
    assert code == 0, err
    trace = load_bundle(bench.folder / "bundle").columns
    assert len(trace["tick"]) == round(500 * SECONDS) and trace["state"][-1] == 2
    assert trace.keys() == fused.keys()
    different = [name for name in trace if not np.array_equal(trace[name], fused[name], equal_nan=True)]
    assert different == []


def test_lost_packets_do_not_change_a_lockstep_run(bench: Bench, fused: dict[str, np.ndarray]) -> None:
    """TCP resends lost packets late. On virtual time a delay has no effect."""
    bench.cable.shape(loss=0.01)
    bench.start_plant("lockstep")
    code, _, err = bench.end(bench.start_loop("lockstep", "--for", "0.2s"))
    assert code == 0, err
    trace = load_bundle(bench.folder / "bundle").columns
    assert all(np.array_equal(trace[n], fused[n][: len(trace[n])], equal_nan=True) for n in trace)


@pytest.mark.realtime
def test_cut_cable_trips_and_the_machine_restarts_only_on_command(bench: Bench) -> None:
    bench.cable.shape(delay=3e-3)
    bench.start_plant("real")
    run = bench.start_loop("real", "--no-arm", **PATIENT)
    with Client(f"ipc://{bench.loop.runtime}/rtctl/{bench.name}.command", timeout=5.0) as client:

        def status() -> dict[str, Any]:
            with contextlib.suppress(UserError):  # the daemon does not answer yet
                return client.call("status")
            return {"ticks": 0, "state": "", "trip": None}

        until(lambda: status()["ticks"], run, 200.0)
        client.call("arm")
        until(lambda: status()["state"] == "running", run)
        client.call("setpoint", value=0.3)
        frames = status()["frames"]["received"]
        until(lambda: status()["frames"]["received"] > frames + 100, run)
        assert status()["state"] == "running"

        bench.cable.shape(loss=1.0)
        trip = until(lambda: status()["trip"], run)
        assert trip["code"] == "link_lost"
        until(lambda: outputs_off(status()), run)  # telemetry lags the state

        bench.cable.shape(delay=3e-3)
        frames = status()["frames"]["received"]
        until(lambda: status()["frames"]["received"] > frames + 100, run)
        assert status()["state"] == "tripped"  # no restart without a command

        def again() -> bool:  # delayed packets may still switch the outputs off
            state = status()["state"]
            if state in ("tripped", "idle"):
                client.call("reset" if state == "tripped" else "arm")
            return bool(state == "running")

        until(again, run)
        frames = status()["frames"]["received"]
        until(lambda: status()["frames"]["received"] > frames + 100, run)
        assert status()["state"] == "running"
        client.call("stop")
    code, out, err = bench.end(run)
    assert code == 0, err
    assert json.loads(out)["tripped"] is None
    trace = load_bundle(bench.folder / "bundle").columns
    off = slice(trip["tick"], int(np.flatnonzero(trace["state"][trip["tick"] :] != 3)[0]) + trip["tick"])
    assert (trace["state"][off] == 3).all()
    assert not trace["u1"][off].any() and not trace["u2"][off].any()
    assert (trace["state"][: trip["tick"]] == 2).any() and (trace["state"][off.stop + 1 :] == 2).any()


def outputs_off(status: dict[str, Any]) -> bool:
    assert status["state"] == "tripped"
    return status["signals"]["u1"] == 0.0 and status["signals"]["u2"] == 0.0


@pytest.mark.realtime
def test_outputs_delayed_beyond_the_link_timeout_have_no_effect(runtime: Path) -> None:
    """Outputs that answer an old sample (by the clock of the plant) are ignored; those for a new sample act."""
    endpoint = f"ipc://{runtime}/waited"
    command = [*RTCTL, "plant", "ivu", "--mode", "real", "--endpoint", endpoint]
    plant = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    context = zmq.Context()
    try:
        assert plant.stdout is not None and plant.stdout.readline()
        socket = context.socket(zmq.DEALER)
        socket.set(zmq.RCVTIMEO, 20_000)
        socket.connect(endpoint)
        first = np.frombuffer(socket.recv(), frames.INPUTS)[0]
        outputs = generate.new_frames()["tx"]
        outputs["ao_codes"], outputs["state"] = 800, 2
        outputs["inputs_t_ns"] = first["t_ns"] - 1_000_000_000
        seen, moved = 0, 0.0
        while seen < 50:  # samples after outdated outputs
            newest = exchange(socket, outputs)
            seen += newest["outputs_seq"] > 0
        assert travelled(first, newest) == 0.0
        while moved < 0.1:
            outputs["inputs_t_ns"] = newest["t_ns"]
            newest = exchange(socket, outputs)
            moved = travelled(first, newest)
    finally:
        context.destroy(linger=0)
        plant.terminate()
        plant.communicate(timeout=20)


def exchange(socket: zmq.Socket, outputs: np.ndarray) -> np.void:
    """Send the outputs with the next sequence number; returns the next sample."""
    outputs["seq"] += 1
    socket.send(outputs.tobytes())
    return np.frombuffer(socket.recv(), frames.INPUTS)[0]


def travelled(before: np.void, after: np.void) -> float:
    """Largest change of the true state of the emulator: angles, tensions, radii."""
    return float(np.nanmax(np.abs(after["truth"] - before["truth"])))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        ("no_keys", "needs keys: run `rtctl keys new`"),
        ("no_pair", "no secret key"),
        ("not_authorized", f"no plant answers at {ENDPOINT} within 0.8 s"),
        ("wrong_server", f"no plant answers at {ENDPOINT} within 0.8 s"),
    ],
)
def test_loop_without_the_right_keys_is_refused(bench: Bench, spoil: str, words: str) -> None:
    more: dict[str, Any] = {"link.timeout": 0.8}
    if spoil == "not_authorized":
        other = bench.plant.keys / "authorized" / "client.key"
        other.unlink()
        new_keys("other", bench.plant.keys)
        bench.give(bench.plant.keys / "other.key", bench.plant.keys / "authorized")
    if spoil == "wrong_server":
        (bench.loop.keys / "server.key").write_bytes((bench.loop.keys / "client.key").read_bytes())
    if spoil == "no_pair":
        (bench.loop.keys / "client.key_secret").unlink()
    if spoil == "no_keys":
        more["link.keys"] = "null"
    if spoil in ("not_authorized", "wrong_server"):
        bench.start_plant("lockstep")
    code, _, err = bench.end(bench.start_loop("lockstep", "--for", "0.1s", **more))
    assert code == 2
    assert words in err
    assert "Traceback" not in err


def test_plant_without_keys_does_not_listen_on_the_network(bench: Bench) -> None:
    process = bench.start(bench.plant, "plant", "ivu", "--mode", "lockstep", "--endpoint", ENDPOINT)
    code, _, err = bench.end(process)
    assert code == 2
    assert f"{ENDPOINT} can be reached from other machines and needs keys" in err
