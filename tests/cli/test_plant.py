"""The emulator by itself, and a loop that drives it over TCP."""

import json
import os
import signal
import socket

import pytest

LOOP = [
    "link.plant=external",
    "loop.realtime=off",
    "safety.link_timeout=10",
    "safety.missed_ticks=0",
    "link.timeout=20",
]


@pytest.fixture
def endpoint(runtime):
    """A loopback port that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp://127.0.0.1:{probe.getsockname()[1]}"


def test_a_loop_drives_a_plant_that_was_there_before(rtctl, started, endpoint, tmp_path):
    name = f"plant{os.getpid()}"
    changes = [word for key in (f"name={name}", f"link.endpoint={endpoint}", *LOOP) for word in ("--set", key)]
    with started("plant", "ivu", "--endpoint", endpoint, "--set", f"name={name}") as plant:
        assert plant.stdout.readline() == f"{name}: plant listens at {endpoint}\n"
        code, _, err = rtctl("plant", "ivu", "--endpoint", endpoint)
        assert code == 2
        assert f"{endpoint} is in use" in err
        words = ["--mode", "real", "--for", "1s", "--json", "--no-plot", "--out", str(tmp_path / "bundle")]
        with started("run", "ivu", *words, *changes) as loop:
            out, err = loop.communicate(timeout=200)
        assert loop.returncode == 0, err
        told = json.loads(out)
        assert (told["ticks"], told["trip"], told["link"]) == (500, None, "zmq")
        assert told["frames"]["received"] > 0
        plant.send_signal(signal.SIGINT)
        assert plant.wait(30) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ivu", "--mode", "fused"], "plant inside"),
        (["ivu", "--endpoint", "tcp://0.0.0.0:5570"], "needs keys"),
        (["nix"], "no such file"),
        (["ivu", "--set", "plant.set=identifed"], "did you mean 'identified'"),
    ],
)
def test_plants_that_cannot_be(rtctl, runtime, words, message):
    code, out, err = rtctl("plant", *words)
    assert (code, out) == (2, "")
    assert message in err
