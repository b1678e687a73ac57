import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client, CommandError
from rtctl.daemon.protocol import decode_request, encode_error, encode_result


@pytest.fixture
def client(context, endpoint):
    with Client(endpoint, timeout=10.0, context=context) as made:
        yield made


@pytest.fixture
def router(context, endpoint):
    """A bare ROUTER socket in place of the server, for replies that no server sends."""
    made = context.socket(zmq.ROUTER)
    made.linger = 0
    made.bind(endpoint)
    yield made
    made.close()


def test_client_returns_results_and_raises_refusals(serving, client, endpoint):
    with serving(endpoint):
        assert client.call("get", path="a.b") == {"op": "get", "args": {"path": "a.b"}}
        with pytest.raises(CommandError, match="not while a capture runs") as caught:
            client.call("stop")
        assert caught.value.code == "refused"
        with pytest.raises(CommandError, match="did you mean 'value'") as caught:
            client.call("setpoint", vlaue=1.0)
        assert caught.value.code == "bad_args"
        with pytest.raises(CommandError, match="finite"):
            client.call("setpoint", value=float("nan"))


def test_call_without_a_daemon_says_how_to_start_one(context, endpoint):
    with (
        Client(endpoint, timeout=0.05, context=context) as client,
        pytest.raises(UserError, match="start one with `rtctl run`"),
    ):
        client.call("ping")


def test_client_works_after_a_restart_of_the_daemon(serving, client, endpoint):
    for _ in range(2):
        with zmq.Context() as daemon, serving(endpoint, context=daemon):
            assert client.call("ping")["pid"]


def test_timed_out_request_is_not_delivered_to_a_later_daemon(serving, context, endpoint, echo):
    with Client(endpoint, timeout=0.05, context=context) as client:
        with pytest.raises(UserError, match="no daemon answers"):
            client.call("arm")
        client.timeout = 10.0
        with serving(endpoint):
            client.call("status")
    assert [op for op, _ in echo.seen] == ["status"]


def test_request_sent_to_a_silent_daemon_may_still_be_carried_out(router, client):
    assert client._connected().poll(10_000, zmq.POLLOUT)
    client.timeout = 0.1
    with pytest.raises(UserError, match="may still do"):
        client.call("arm")
    assert router.poll(5000)


def test_client_skips_late_replies_to_other_calls(router, client):
    client._connected().send(b"hello")
    assert router.poll(5000)
    peer = router.recv_multipart()[0]
    router.send_multipart([peer, encode_result("another call", {"late": True})])
    router.send_multipart([peer, encode_error(None, "malformed", "what was that")])
    with pytest.raises(CommandError, match="what was that"):
        client.call("status")
    assert decode_request(router.recv_multipart()[1]).op == "status"


def test_reply_that_is_not_of_the_protocol_is_an_error(router, client):
    client._connected().send(b"hello")
    assert router.poll(5000)
    router.send_multipart([router.recv_multipart()[0], b"HTTP/1.1 400"])
    with pytest.raises(UserError, match="does not answer as a daemon"):
        client.call("status")


@pytest.mark.parametrize("value", [2**70, object(), "x" * 70_000])
def test_argument_that_cannot_be_encoded_is_refused(client, value):
    with pytest.raises(UserError, match="'set' cannot be sent"):
        client.call("set", path="a", value=value)


def test_client_of_a_network_address_needs_keys(context):
    with pytest.raises(UserError, match="rtctl keys new"):
        Client("tcp://192.0.2.7:9871", context=context)


def test_endpoint_without_a_port_does_not_answer(context):
    with Client("tcp://127.0.0.1", context=context) as client, pytest.raises(UserError, match="does not answer"):
        client.call("ping")
