import numpy as np
import pytest
import zmq

from rtctl.daemon.rows import MOST_ROWS, RowsOut, decode
from rtctl.idiom import state

ROW = state(tick=int, t=float, u=float)


@pytest.fixture
def made(context, endpoint):
    out = RowsOut(endpoint, "ivu", ROW, context)
    yield out
    out.close()


def rows(first, count):
    made = np.zeros(count, ROW)
    made["tick"] = np.arange(first, first + count)
    made["u"] = 0.1 * made["tick"]
    return made


def subscriber(context, out, topic="ivu"):
    socket = context.socket(zmq.SUB)
    socket.linger = 0
    socket.subscribe(topic)
    socket.connect(out.endpoint)
    while not out.publish(rows(0, 1)):
        pass  # the subscription has not arrived yet
    socket.recv_multipart()
    return socket


def test_published_rows_arrive_bit_exact_with_their_dtype(context, made):
    socket = subscriber(context, made)
    sent = rows(7, 5000)
    assert made.publish(sent)
    topic, head, payload = socket.recv_multipart()
    _, dtype = decode(head)
    assert topic == b"ivu"
    assert dtype.names == ROW.names
    assert np.array_equal(np.frombuffer(payload, dtype), sent)


def test_no_rows_are_sent_without_a_subscriber(made):
    assert not made.publish(rows(0, 10))


def test_no_rows_are_sent_after_the_last_subscriber_has_left(context, made):
    subscriber(context, made).close()
    while made.publish(rows(0, 1)):
        pass


def test_newest_rows_are_sent_when_there_are_too_many(context, made):
    socket = subscriber(context, made)
    made.publish(rows(0, MOST_ROWS + 10))
    _, head, payload = socket.recv_multipart()
    assert np.frombuffer(payload, decode(head)[1])["tick"][0] == 10


@pytest.mark.parametrize("head", [b"", b"\xff", b"\x80", b"\x83\xa3pid\x01\xa5names\x91\xa1a\xa5types\x90"])
def test_invalid_row_header_is_refused(head):
    with pytest.raises(ValueError, match="not the head"):
        decode(head)
