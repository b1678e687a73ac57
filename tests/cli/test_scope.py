import json
import os

import pytest
import zmq

from rtctl.cli import common, scope
from rtctl.daemon.server import CommandServer, default_endpoint


class Fine:
    """Stub of a daemon that answers `status` and `signals`."""

    def __init__(self, name):
        self.name = name

    def handle(self, op, args):
        if op == "signals":
            return {"signals": [{"name": "u", "unit": "V", "help": ""}]}
        return {"name": self.name, "machine": "ivu", "pid": os.getpid(), "rate_hz": 500.0, "value": {}}


@pytest.fixture
def late(runtime):
    """`late(name)`: the command socket of a daemon that does not answer until `process` is called."""
    context, made = zmq.Context(), []

    def make(name):
        made.append(CommandServer(default_endpoint(name, "command"), Fine(name), context))
        return made[-1]

    yield make
    for server in made:
        server.close()
    context.destroy(linger=0)


def answering(server, process):
    """Answer requests until the scope prints its next line; returns the line."""
    poller = zmq.Poller()
    poller.register(server.socket, zmq.POLLIN)
    poller.register(process.stderr.fileno(), zmq.POLLIN)
    while process.stderr.fileno() not in (ready := dict(poller.poll())):
        assert server.socket in ready
        server.process()
    return process.stderr.readline()


def test_scope_serves_its_page_while_it_waits_for_a_named_machine(started, late):
    name = f"late{os.getpid()}"
    with started("scope", name, "--port", "0") as process:
        assert process.stdout.readline().startswith(f"{name}, read-only: http://127.0.0.1:")
        assert f"{name} does not run yet; waiting for it" in process.stderr.readline()
        server = late(name)
        assert f"{name} is there but does not answer yet: it compiles its tick" in process.stderr.readline()
        assert answering(server, process) == f"{name} answers\n"


def test_scope_without_a_name_takes_the_first_machine_that_starts(rtctl, runtime, monkeypatch, late):
    late("first")
    looks = iter([[], [], ["first"], ["first"]])
    monkeypatch.setattr(common, "running", lambda: next(looks))
    monkeypatch.setattr(scope.time, "sleep", lambda _: None)
    assert scope._name(None) == "first"


def test_scope_needs_a_name_when_several_machines_run(rtctl, runtime, monkeypatch):
    monkeypatch.setattr(common, "running", lambda: ["ivu", "ldu"])
    code, out, err = rtctl("scope")
    assert (code, out) == (2, "")
    assert "several machines run: ivu, ldu" in err


def test_name_similar_to_a_running_machine_gives_a_hint(capsys, monkeypatch):
    monkeypatch.setattr(common, "running", lambda: ["ivu", "ldu"])
    assert scope._name("iuv") == "iuv"
    assert capsys.readouterr().err == "of other machines there is ivu, ldu; did you mean 'ivu'?\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["tcp://127.0.0.1:5"], "give the machine's name"),
        (["no/body"], "'no/body' cannot name a socket"),
        (["ivu.yaml"], "not the file"),
        (["--port", "70000"], "--port"),
        (["--contorl"], "--contorl"),
    ],
)
def test_invalid_arguments_give_one_line(rtctl, runtime, monkeypatch, words, message):
    monkeypatch.setattr(common, "running", lambda: [])
    code, out, err = rtctl("scope", *words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1


def test_watch_waits_for_a_starting_daemon(started, late):
    name = f"watch{os.getpid()}"
    server = late(name)
    with started("status", "--watch", "--json", "--name", name) as process:
        assert "does not answer yet: it compiles its tick" in process.stderr.readline()
        poller = zmq.Poller()
        poller.register(server.socket, zmq.POLLIN)
        poller.register(process.stdout.fileno(), zmq.POLLIN)
        while process.stdout.fileno() not in dict(poller.poll()):
            server.process()
        assert json.loads(process.stdout.readline())["name"] == name
