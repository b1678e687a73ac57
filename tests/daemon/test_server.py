import os
import re
import socket as sockets
from pathlib import Path

import msgpack
import pytest
import zmq
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.daemon import protocol, server
from rtctl.daemon.child import link_socket
from rtctl.daemon.protocol import decode_reply, encode_request
from rtctl.daemon.server import CommandServer, default_endpoint, find_endpoint, runtime_dir


@pytest.fixture
def idle(context, echo, endpoint):
    """A command server without a thread: the test calls `process`."""
    made = CommandServer(endpoint, echo, context)
    yield made
    made.close()


def connected(context, endpoint, kind=zmq.DEALER):
    made = context.socket(kind)
    made.linger = 0
    made.connect(endpoint)
    return made


def reply_to(idle, peer):
    """Let the server answer once and return the reply."""
    assert idle.socket.poll(5000)
    assert idle.process() == 1
    assert peer.poll(5000)
    return decode_reply(peer.recv_multipart()[-1])


@pytest.mark.parametrize("kind", [zmq.DEALER, zmq.REQ])
def test_server_answers_dealer_and_req_sockets(idle, context, endpoint, kind):
    peer = connected(context, endpoint, kind)
    peer.send(encode_request(5, "get", {"path": "a.b"}))
    reply = reply_to(idle, peer)
    assert (reply.id, reply.result) == (5, {"op": "get", "args": {"path": "a.b"}})
    assert (idle.accepted, idle.refused) == (1, {})


def test_server_handles_at_most_max_messages(idle, context, endpoint):
    peer = connected(context, endpoint)
    for number in range(5):
        peer.send(encode_request(number, "ping", {}))
    assert idle.socket.poll(5000)
    handled = 0
    while handled < 5:
        assert idle.socket.poll(5000)
        count = idle.process(max_messages=2)
        assert 1 <= count <= 2
        handled += count
    assert idle.process() == 0


@pytest.mark.parametrize(
    ("op", "code", "words"),
    [
        ("stop", "refused", "not while a capture runs"),
        ("reset", "internal", "RuntimeError: boom"),
        ("play", "refused", "/data: no space left on device"),
        ("disarm", "internal", "must be a map"),
        ("signals", "too_large", "the result of 'signals' is"),
    ],
)
def test_handler_failures_become_error_replies(idle, echo, op, code, words):
    reply = decode_reply(idle.answer(encode_request(1, op, {})))
    assert (reply.code, reply.id) == (code, 1)
    assert words in reply.message
    assert (idle.accepted, idle.refused) == (0, {code: 1})
    assert echo.seen[-1][0] == op


def test_ping_needs_no_handler(idle, echo):
    reply = decode_reply(idle.answer(encode_request(1, "ping", {})))
    assert reply.result["pid"] == os.getpid()
    assert reply.result["protocol"] == [1]
    assert not echo.seen


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=300)
    | st.dictionaries(st.sampled_from(["v", "id", "op", "args"]), st.none() | st.integers(0, 1) | st.text()).map(
        msgpack.packb
    )
)
def test_server_survives_malformed_messages(idle, data):
    assert decode_reply(idle.answer(data)).code in {*protocol.ERRORS, ""}
    assert decode_reply(idle.answer(encode_request(1, "ping", {}))).code == ""


def test_large_message_is_refused_and_far_too_large_message_closes_the_connection(idle, context, endpoint):
    peer = connected(context, endpoint)
    peer.send(b"x" * (protocol.MAX_BYTES + 1))
    assert reply_to(idle, peer).code == "too_large"
    peer.send(b"x" * (server.MAX_FRAME + 1))
    other = connected(context, endpoint)
    other.send(encode_request(1, "ping", {}))
    assert reply_to(idle, other).code == ""


def test_multipart_message_is_refused(idle, context, endpoint):
    peer = connected(context, endpoint)
    peer.send_multipart([b"a", b"b", encode_request(1, "arm", {})])
    assert reply_to(idle, peer).code == "malformed"


def test_replies_to_closed_and_unread_sockets_do_not_block(idle, context, endpoint, echo):
    dead = connected(context, endpoint)
    dead.send(encode_request(1, "status", {}))
    assert idle.socket.poll(5000)
    dead.close()
    assert idle.process() == 1
    deaf = context.socket(zmq.DEALER)
    deaf.linger, deaf.rcvhwm = 0, 1
    deaf.connect(endpoint)
    sent = handled = 0
    while sent < 20 * server.WAITING:
        deaf.send(encode_request(1, "set", {"path": "a", "value": "x" * 10_000}))
        sent += 1
        while handled < sent:
            assert idle.socket.poll(5000)
            handled += idle.process()
    assert handled == idle.accepted - 1


def test_socket_of_a_live_daemon_is_not_taken_over(idle, context, echo, endpoint):
    with pytest.raises(UserError, match=rf"in use by another daemon \(pid {os.getpid()}\)"):
        CommandServer(endpoint, echo, context)
    peer = connected(context, endpoint)
    peer.send(encode_request(1, "ping", {}))
    assert reply_to(idle, peer).code == ""


def test_socket_file_left_by_a_crash_is_replaced(serving, context, endpoint):
    with sockets.socket(sockets.AF_UNIX) as crashed:
        crashed.bind(endpoint.removeprefix("ipc://"))
    with serving(endpoint):
        peer = connected(context, endpoint)
        peer.send(encode_request(1, "ping", {}))
        assert peer.poll(5000)


def test_file_that_is_not_a_socket_is_kept(context, echo, endpoint, tmp_path):
    (tmp_path / "c").write_text("thesis")
    with pytest.raises(UserError, match="is not a socket"):
        CommandServer(endpoint, echo, context)
    assert (tmp_path / "c").read_text() == "thesis"


def test_tcp_port_in_use_error_names_the_daemon_or_another_program(serving, context, echo):
    with serving("tcp://127.0.0.1:*") as first:
        assert re.fullmatch(r"tcp://127\.0\.0\.1:\d+", first.endpoint)
        with pytest.raises(UserError, match=rf"another daemon \(pid {os.getpid()}\)"):
            CommandServer(first.endpoint, echo, context)
    other = sockets.create_server(("127.0.0.1", 0))
    with other, pytest.raises(UserError, match="in use by another program"):
        CommandServer(f"tcp://127.0.0.1:{other.getsockname()[1]}", echo, context)


@pytest.mark.parametrize(
    ("endpoint", "words"),
    [
        ("tcp://0.0.0.0:9871", "rtctl keys new"),
        ("tcp://*:9871", "rtctl keys new"),
        ("tcp://127.0.0.1", "cannot bind"),
        ("carrier-pigeon://x", "is no endpoint"),
        ("", "is no endpoint"),
        ("ipc://relative", "absolute path"),
        ("ipc://@abstract", "absolute path"),
        (f"ipc://{Path(__file__)}/c", "cannot be used"),  # parent path is a file
        ("ipc:///tmp/" + "x" * 200, "107 is the most"),
    ],
)
def test_invalid_endpoint_is_refused(context, echo, endpoint, words):
    with pytest.raises(UserError, match=words):
        CommandServer(endpoint, echo, context)


@pytest.mark.parametrize("bind", [True, False], ids=["plant", "loop"])
@pytest.mark.parametrize(
    "endpoint", ["tcp://192.0.2.7:9873", "tcp://*:9873", "tcp://eth0:9873", "tcp://plant.local:9873"]
)
def test_link_beyond_the_host_needs_keys(context, endpoint, bind):
    with pytest.raises(UserError, match=r"can be reached from other machines and needs keys: run `rtctl keys new`"):
        link_socket(context, endpoint, bind, 1.0, None)


def test_runtime_dir_follows_xdg(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert runtime_dir() == tmp_path / "rtctl"
    assert (tmp_path / "rtctl").stat().st_mode & 0o777 == 0o700
    assert default_endpoint("ivu", "command") == f"ipc://{tmp_path}/rtctl/ivu.command"
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "gone"))
    with pytest.raises(UserError, match="cannot make"):
        runtime_dir()


@pytest.fixture
def no_xdg(monkeypatch, tmp_path):
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setattr(server, "SYSTEM_DIR", tmp_path / "run")
    monkeypatch.setattr(server, "TEMPORARY_DIR", tmp_path)
    return tmp_path


def test_runtime_dir_of_a_service_and_of_a_user(no_xdg):
    mine = no_xdg / f"rtctl-{os.geteuid()}"
    assert runtime_dir() == mine
    assert mine.stat().st_mode & 0o777 == 0o700
    (no_xdg / "run").mkdir()
    assert runtime_dir() == no_xdg / "run"


@pytest.mark.parametrize("trap", ["readable", "link", "file"])
def test_runtime_dir_in_tmp_that_is_not_private_is_refused(no_xdg, trap):
    mine = no_xdg / f"rtctl-{os.geteuid()}"
    if trap == "readable":
        mine.mkdir()
        mine.chmod(0o755)
    elif trap == "link":
        (no_xdg / "theirs").mkdir(mode=0o700)
        mine.symlink_to(no_xdg / "theirs")
    else:
        mine.touch()
    with pytest.raises(UserError, match=r"not a private folder|cannot make"):
        runtime_dir()


def test_client_finds_the_system_service_when_the_user_has_no_daemon(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(server, "SYSTEM_DIR", tmp_path / "run")
    own = default_endpoint("ivu", "command")
    assert find_endpoint("ivu", "command") == own
    (tmp_path / "run").mkdir()
    (tmp_path / "run/ivu.command").touch()
    assert find_endpoint("ivu", "command") == f"ipc://{tmp_path}/run/ivu.command"
    Path(own.removeprefix("ipc://")).touch()
    assert find_endpoint("ivu", "command") == own


@pytest.mark.parametrize("name", ["", "../x", "a/b", ".hidden", "a b"])
def test_machine_name_that_is_not_a_file_name_is_refused(name):
    with pytest.raises(UserError, match="cannot name a socket"):
        default_endpoint(name, "command")


def test_runtime_dir_too_long_for_a_socket_path_is_refused(monkeypatch, tmp_path):
    deep = tmp_path / ("d" * 100)
    deep.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(deep))
    with pytest.raises(UserError, match="set XDG_RUNTIME_DIR to a shorter folder"):
        default_endpoint("ivu", "command")
