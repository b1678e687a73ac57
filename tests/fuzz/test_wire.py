"""Random bytes and mutated ZeroMQ against the sockets of a daemon; the sockets must keep working."""

import random
import socket as sockets

import mutators
import numpy as np
import pytest
import zmq

from rtctl.daemon.protocol import decode_reply, encode_request
from rtctl.daemon.server import CommandServer
from rtctl.daemon.telemetry import Telemetry

GREETING = b"\xff" + bytes(8) + b"\x7f" + b"\x03\x00" + b"NULL".ljust(20, b"\0") + b"\x00" + bytes(31)
READY = b"\x04\x19\x05READY\x0bSocket-Type\x00\x00\x00\x03SUB"
SUBSCRIBE = b"\x00\x04\x01ivu"
LARGE = b"\x02\x7f\xff\xff\xff\xff\xff\xff\xff"  # a frame that claims 2^63 bytes


@pytest.fixture
def context():
    context = zmq.Context()
    yield context
    context.destroy(linger=0)


def blobs():
    rng = random.Random(3)
    whole = (GREETING + READY + SUBSCRIBE, GREETING + READY + LARGE, GREETING)
    yield from whole
    for _ in range(150):
        yield mutators.of_bytes(rng, whole)


def throw(path, data):
    """Connect, send and close without waiting for an answer."""
    with sockets.socket(sockets.AF_UNIX) as thrower:
        thrower.settimeout(10)
        thrower.connect(str(path))
        try:
            thrower.sendall(data)
            thrower.shutdown(sockets.SHUT_WR)
            while thrower.recv(4096):
                pass
        except (BrokenPipeError, ConnectionResetError):  # cut off in the middle
            pass
        except TimeoutError:
            raise AssertionError(f"neither answered nor cut off: {data[:200]!r}") from None


def test_command_socket_survives_random_bytes(context, tmp_path):
    server = CommandServer(f"ipc://{tmp_path}/c", None, context)
    for data in blobs():
        throw(tmp_path / "c", data)
        server.process()
    client = context.socket(zmq.DEALER)
    client.linger = 0
    client.connect(server.endpoint)
    client.send(encode_request(1, "ping", {}))
    while not client.poll(20):
        server.process()
    assert decode_reply(client.recv()).code == ""
    server.close()


def test_telemetry_socket_survives_random_bytes(context, tmp_path):
    telemetry = Telemetry(f"ipc://{tmp_path}/t", "ivu", ["v"], context)
    for data in blobs():
        throw(tmp_path / "t", data)
        telemetry.publish(np.zeros((1, 2)))
    reader = context.socket(zmq.SUB)
    reader.linger = 0
    reader.subscribe("ivu")
    reader.connect(telemetry.endpoint)
    while not reader.poll(20):
        telemetry.publish(np.zeros((1, 2)))
    assert reader.recv_multipart()[0] == b"ivu"
    telemetry.close()
