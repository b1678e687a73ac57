import shutil

import msgpack
import numpy as np
import pytest
import zmq
from hypothesis import given
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.daemon.keys import apply_client, client_curve, new_keys, server_curve
from rtctl.daemon.telemetry import MESSAGES_WAITING, Telemetry, thin

ROWS = np.array([[0.0, 1.0, 2.0], [0.1, 3.0, np.nan]])


@pytest.fixture
def made(context, endpoint):
    telemetry = Telemetry(endpoint, "ivu", ["v", "u"], context, max_rows_per_message=10)
    yield telemetry
    telemetry.close()


def subscriber(context, telemetry, publish, hwm=1000):
    """A SUB socket that has seen its first message: the subscription has arrived at the publisher."""
    socket = context.socket(zmq.SUB)
    socket.linger, socket.rcvhwm = 0, hwm
    socket.subscribe("ivu")
    socket.connect(telemetry.endpoint)
    for _ in range(500):
        publish()
        if socket.poll(20):
            while socket.poll(50):
                socket.recv_multipart()
            return socket
    raise AssertionError("the subscription never arrived")


def next_message(socket, telemetry):
    """Publish until a message arrives. libzmq checks a full queue only every second millisecond."""
    for _ in range(500):
        telemetry.publish(ROWS)
        if socket.poll(20):
            return socket.recv_multipart()
    raise AssertionError("no message within 10 s")


def test_telemetry_sends_topic_and_rows_in_the_format_of_plotjuggler(context, made):
    socket = subscriber(context, made, lambda: made.publish(ROWS))
    assert made.publish(ROWS) == 2
    topic, payload = socket.recv_multipart()
    rows = msgpack.unpackb(payload)
    assert topic == b"ivu"
    assert rows[0] == {"timestamp": 0.0, "v": 1.0, "u": 2.0}
    assert list(rows[1]) == ["timestamp", "v", "u"]
    assert np.isnan(rows[1]["u"])


def test_without_batch_each_row_is_a_message(context, endpoint):
    telemetry = Telemetry(endpoint, "ivu", ["v", "u"], context, batch=False)
    socket = subscriber(context, telemetry, lambda: telemetry.publish(ROWS))
    telemetry.publish(ROWS)
    messages = [msgpack.unpackb(socket.recv_multipart()[1]) for _ in range(2)]
    assert [message["timestamp"] for message in messages] == [0.0, 0.1]


def test_telemetry_counts_the_rows_it_leaves_out(made):
    many = np.zeros((25, 3))
    assert made.publish(many) == 9
    assert (made.sent, made.thinned) == (9, 16)
    assert made.publish(np.zeros((0, 3))) == 0


@given(st.integers(0, 500), st.integers(1, 60))
def test_thinning_keeps_the_newest_and_even_gaps(n, most):
    kept = thin(np.arange(n), most)
    assert len(kept) <= most
    assert n == 0 or kept[-1] == n - 1
    assert len(set(np.diff(kept))) <= 1
    if n <= most:
        assert len(kept) == n
    else:
        assert len(kept) > most // 2


def test_slow_subscriber_loses_messages_and_does_not_block(context, made):
    socket = subscriber(context, made, lambda: made.publish(ROWS), hwm=1)
    wide = np.zeros((10, 3))
    for number in range(50 * MESSAGES_WAITING):
        wide[:, 0] = number
        made.publish(wide)
    received = 0
    while socket.poll(100):
        socket.recv_multipart()
        received += 1
    assert 1 <= received < 50 * MESSAGES_WAITING


def test_subscriber_that_never_reads_does_not_affect_others(context, made):
    deaf = [subscriber(context, made, lambda: made.publish(ROWS), hwm=1) for _ in range(3)]
    reader = subscriber(context, made, lambda: made.publish(ROWS))
    for _ in range(5 * MESSAGES_WAITING):  # queues of the subscribers that do not read are full
        next_message(reader, made)
    assert len(deaf) == 3


def test_subscriber_with_too_long_a_topic_is_disconnected(context, made):
    greedy = context.socket(zmq.SUB)
    greedy.linger = 0
    greedy.subscribe("x" * 100_000)
    greedy.subscribe("ivu")
    greedy.connect(made.endpoint)
    reader = subscriber(context, made, lambda: made.publish(ROWS))
    for _ in range(20):
        next_message(reader, made)
    assert not greedy.poll(0)


def test_subscriber_beyond_the_host_needs_an_authorized_key(tmp_path):
    """Telemetry beyond the host is for clients with a key in `authorized`."""
    for name in ("server", "alice", "mallory"):
        new_keys(name, tmp_path)
    shutil.copy(tmp_path / "alice.key", tmp_path / "authorized")
    with zmq.Context() as own:  # ZAP authentication holds for the whole context
        telemetry = Telemetry("tcp://127.0.0.1:*", "ivu", ["v", "u"], own, curve=server_curve(tmp_path))
        with zmq.Context() as far:
            others = []
            for name in ("mallory", None):
                others.append(far.socket(zmq.SUB))
                others[-1].linger = 0
                others[-1].subscribe("ivu")
                if name:
                    curve = client_curve(name, tmp_path)
                    apply_client(others[-1], curve.keys, curve.server)
                others[-1].connect(telemetry.endpoint)
            alice = far.socket(zmq.SUB)
            alice.linger = 0
            alice.subscribe("ivu")
            curve = client_curve("alice", tmp_path)
            apply_client(alice, curve.keys, curve.server)
            alice.connect(telemetry.endpoint)
            for _ in range(500):
                telemetry.publish(ROWS)
                if alice.poll(20):
                    break
            for _ in range(20):
                telemetry.publish(ROWS)
            assert alice.recv_multipart()[0] == b"ivu"
            assert not any(other.poll(0) for other in others)
            for socket in (alice, *others):
                socket.close()
        telemetry.close()


def test_telemetry_beyond_the_host_needs_keys(context):
    with pytest.raises(UserError, match=r"tcp://0\.0\.0\.0:9872 can be reached from other machines and needs keys"):
        Telemetry("tcp://0.0.0.0:9872", "ivu", ["v"], context)


@pytest.mark.parametrize("shape", [(3,), (2, 2), (2, 4)])
def test_rows_of_the_wrong_shape_are_refused(made, shape):
    with pytest.raises(ValueError, match="3 names: timestamp, v, u"):
        made.publish(np.zeros(shape))


def test_duplicate_names_and_empty_messages_are_refused(context, endpoint):
    with pytest.raises(ValueError, match="twice"):
        Telemetry(endpoint, "ivu", ["v", "timestamp"], context)
    with pytest.raises(ValueError, match="at least 1"):
        Telemetry(endpoint, "ivu", ["v"], context, max_rows_per_message=0)


def test_second_publisher_on_an_endpoint_is_refused(context, made, endpoint):
    with pytest.raises(UserError, match="in use by another daemon"):
        Telemetry(endpoint, "ivu", ["v"], context)
