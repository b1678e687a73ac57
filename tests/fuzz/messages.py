"""What comes over sockets and the link: requests, replies, telemetry, frames."""

import itertools
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgpack
import numpy as np
import structlog
import yaml
import zmq
from target import CONFIGS, Target, of_bytes, of_packs

from rtctl import machines
from rtctl.config.load import set_path
from rtctl.daemon import protocol
from rtctl.daemon.captures import Captures
from rtctl.daemon.commands import Commands
from rtctl.daemon.faults import Faults
from rtctl.daemon.protocol import ProtocolError, decode_reply, decode_request, encode_request, encode_result
from rtctl.daemon.server import CommandServer
from rtctl.daemon.supervisor import Supervisor
from rtctl.daemon.telemetry import Telemetry
from rtctl.daemon.watched import Watched
from rtctl.loop import generate
from rtctl.loop.loop import Loop
from rtctl.loop.mailbox import Mailbox
from rtctl.loop.records import layout
from rtctl.tick import frames
from rtctl.tick.memory import Segment

REQUESTS = (
    encode_request(1, "ping", {}),
    encode_request("a-1", "status", {}),
    encode_request(2, "get", {"path": "law.position.gain"}),
    encode_request(3, "set", {"path": "law.position.gain", "value": 100.0}),
    encode_request(3, "set", {"path": "law.tension.F_t", "value": "0.5 N"}),
    encode_request(4, "setpoint", {"value": 5.0, "unit": "mm", "ramp": 20.0, "ramp_unit": "mm/s"}),
    encode_request(5, "capture", {"seconds": 1.0, "pre": 0.5, "trigger": "abs(u1) > 2 and capstan < 1"}),
    encode_request(6, "capture_status", {"id": "1"}),
    encode_request(8, "fault", {"action": "add", "fault": {"fault": "encoder.freeze", "at": "1 s", "lasts": "200 ms"}}),
    *(encode_request(7, op, {}) for op in ("signals", "arm", "disarm", "reset", "play", "stop")),
)
REPLIES = (
    encode_result(1, {"pid": 7, "version": "0.1.0", "protocol": [1]}),
    encode_result("a-1", {"ticks": 5, "lateness_us": {"p50": 1.5}, "trip": None}),
    protocol.encode_error(2, "refused", "not armed"),
)


def request(_: Path) -> Target:
    """A request as it comes off the socket."""

    def feed(data: bytes) -> None:
        try:
            found = decode_request(data)
        except ProtocolError as error:
            assert error.code in protocol.ERRORS and len(error.message) < 3000, error.code
            decode_reply(protocol.encode_error(error.id, error.code, error.message))
        else:
            assert type(found.args) is protocol.OPS[found.op]

    return Target(feed, of_packs(REQUESTS))


def reply(_: Path) -> Target:
    """A reply, as a client reads it from whatever it has connected to."""

    def feed(data: bytes) -> None:
        try:
            found = decode_reply(data)
        except ProtocolError as error:
            assert error.code in protocol.ERRORS, error.code
        else:
            assert isinstance(found.result, dict) and isinstance(found.message, str)

    return Target(feed, of_packs(REPLIES))


def command(folder: Path) -> Target:
    """A request to a machine that stands still, carried out: whatever it is, the daemon does not fail."""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(50))  # the findings say it
    supervisor = _standing(folder)
    first = supervisor.config, supervisor.machine
    server = CommandServer("inproc://fuzz", Commands(supervisor), zmq.Context())

    def feed(data: bytes) -> None:
        answer = decode_reply(server.answer(data))
        assert answer.code != "internal", answer.message
        if supervisor.changes:
            supervisor.config, supervisor.machine = first
            supervisor.changes.clear()
        supervisor.captures.close()

    return Target(feed, of_packs(REQUESTS))


def _standing(folder: Path) -> Any:
    """A supervisor without processes and sockets. Captures go into `folder`, whatever is asked for."""
    data = yaml.safe_load((CONFIGS / "ivu.yaml").read_text())
    made: Any = Supervisor(machines.CONFIGS["ivu"].model_validate(data), None)
    shape = layout(made.made.params, made.made.tables, made.made.row, 10)
    made.segment = Segment.create(folder / "segment", shape)
    made.status, made.mailbox = made.segment["status"][0], Mailbox(made.segment)
    made.reader, made.server = SimpleNamespace(lost=0), SimpleNamespace(refused={})
    made.journal, made.watched = SimpleNamespace(note=lambda *_: None), Watched()
    made.faults, made.recorder, made.last_row = Faults(made), None, made.segment["rows"][0]
    captures = made.captures = Captures(made.machine.rate, made.made.columns, made.made.row, {"plant": "ivu"})
    start, names = captures.start, itertools.count()

    def here(seconds: float, pre: float, trigger: str | None, out: str | None, name: str) -> dict[str, Any]:
        captures._done.clear()
        return start(seconds, pre, trigger, str(folder / f"c{next(names)}"), name)

    captures.start = here
    return made


def telemetry(_: Path) -> Target:
    """Rows that hold whatever bits there are: a message that can be read goes out, or a ValueError says why not."""
    made = Telemetry("inproc://telemetry", "ivu", ["v", "u"], zmq.Context(), max_rows_per_message=20)
    sent: list[bytes] = []
    made._send = lambda payload: sent.append(msgpack.packb(payload))

    def feed(data: bytes) -> None:
        rows = np.frombuffer(data[: len(data) // 8 * 8], "<f8")
        columns = 3 if len(data) % 7 else 2
        rows = rows[: len(rows) // columns * columns].reshape(-1, columns)
        sent.clear()
        try:
            count = made.publish(rows)
        except ValueError:
            assert columns == 2
            return
        assert count <= 20 and sum(len(msgpack.unpackb(payload)) for payload in sent) == count

    seeds = tuple(np.linspace(0.0, 9.0, n).tobytes() for n in (3, 30, 300))
    return Target(feed, of_bytes(*seeds))


def frame(_: Path) -> Target:
    """A frame from the plant: whatever it says, the tick ends and its outputs are codes that the board has."""
    data = yaml.safe_load((CONFIGS / "ivu.yaml").read_text())
    config = set_path(machines.CONFIGS["ivu"].model_validate(data), "loop.mode", "lockstep")
    machine = machines.build(config)
    made = generate.generate(machine, "shm")
    arrays = layout(made.params, made.tables, made.row, 10).items()
    segment: Any = {name: np.zeros(count, dtype) for name, (dtype, count) in arrays}
    generate.fill(segment["mailbox"][0]["params"], machine.diagram.blocks)
    generate.fill_tables(segment["tables"][0], (machine.reference, machine.excitation))
    loop = Loop(machine, made, segment, segment["outputs"], segment["inputs"])
    box, slot, status = Mailbox(segment), segment["inputs"][0], segment["status"][0]
    good = np.zeros(1, frames.INPUTS)
    good["magic"], good["version"] = frames.MAGIC, frames.VERSION

    def again(_: Any, command: Any) -> None:
        command["reset"] += 1
        command["arm"] += 1
        command["play"] += 1

    def tick(found: bytes) -> None:
        loop_tick = int(status["tick"])
        slot["frame"] = np.frombuffer(found, frames.INPUTS)[0]
        slot["count"] += 2
        loop.stretch(loop_tick, 1)
        assert int(status["tick"]) == loop_tick + 1 and not status["failed"]
        codes = segment["outputs"][0]["frame"]["ao_codes"]
        assert (codes >= -2048).all() and (codes <= 2047).all(), codes
        assert 0 <= int(status["state"]) <= 3
        if int(status["state"]) in (0, 3):
            assert not codes.any(), (codes, int(status["state"]))

    def feed(data: bytes) -> None:
        size = frames.INPUTS.itemsize
        found = np.frombuffer(data[:size].ljust(size, b"\0"), frames.INPUTS).copy()
        if len(data) % 5:  # mostly one that is taken for a frame; others are never looked at
            found["magic"], found["version"] = frames.MAGIC, frames.VERSION
            found["seq"] = abs(int(found["seq"][0])) % 2**62
        if frames.valid.py_func(found.view(np.recarray)[0]):
            if int(status["state"]) == 3:
                box.post(again)
            tick(found.tobytes())

    box.post(again)
    for seq in range(200):
        good["seq"] = seq
        tick(good.tobytes())
    return Target(feed, of_bytes(good.tobytes()))
