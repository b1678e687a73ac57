import os
import shutil
import subprocess
import sys

import pytest
import zmq

from rtctl.config.errors import UserError
from rtctl.daemon.client import Client
from rtctl.daemon.keys import ClientCurve, client_curve, load_keys, load_public, new_keys, require_curve, server_curve

TCP = "tcp://127.0.0.1:*"


@pytest.fixture
def keys(tmp_path):
    """A folder with the keys of a server, of alice (authorized) and of mallory (not authorized)."""
    for name in ("server", "alice", "mallory"):
        new_keys(name, tmp_path)
    shutil.copy(tmp_path / "alice.key", tmp_path / "authorized")
    return tmp_path


@pytest.fixture
def far():
    """A context for clients, as in another process."""
    context = zmq.Context()
    yield context
    context.destroy(linger=0)


def test_secret_key_file_is_readable_by_its_owner_only(tmp_path):
    old = os.umask(0)
    try:
        public, secret = new_keys("server", tmp_path)
    finally:
        os.umask(old)
    assert secret.stat().st_mode & 0o777 == 0o600
    assert b"secret-key" not in public.read_bytes()
    assert load_keys("server", tmp_path).public == load_public(public)


def test_keys_are_never_overwritten(keys):
    before = load_keys("server", keys)
    with pytest.raises(UserError, match="exists"):
        new_keys("server", keys)
    assert load_keys("server", keys) == before


def test_secret_key_readable_by_others_is_refused(keys):
    (keys / "alice.key_secret").chmod(0o640)
    with pytest.raises(UserError, match=r"mode 0640.*chmod 600"):
        load_keys("alice", keys)


@pytest.mark.parametrize("text", ["", "public-key = 'short'", 'public-key = "' + "~" * 40 + '"'])
def test_damaged_key_file_is_refused(keys, text):
    path = keys / "alice.key_secret"
    path.write_text(text)
    with pytest.raises(UserError, match=r"alice\.key_secret"):
        load_keys("alice", keys)


def test_missing_keys_error_says_how_to_make_them(tmp_path):
    with pytest.raises(UserError, match="rtctl keys new bob"):
        load_keys("bob", tmp_path)
    new_keys("server", tmp_path)
    with pytest.raises(UserError, match=r"copy the public NAME\.key"):
        server_curve(tmp_path)
    with pytest.raises(UserError, match="no name for keys"):
        new_keys("../bob", tmp_path)


@pytest.mark.parametrize(
    ("endpoint", "required"),
    [
        ("ipc:///run/rtctl/x", False),
        ("inproc://x", False),
        ("tcp://127.0.0.1:5", False),
        ("tcp://127.9.9.9:*", False),
        ("tcp://[::1]:5", False),
        ("tcp://localhost:5", False),
        ("tcp://*:5", True),
        ("tcp://0.0.0.0:5", True),
        ("tcp://[::]:5", True),
        ("tcp://eth0:5", True),
        ("tcp://192.168.1.2:5", True),
        ("tcp://localhost.example.org:5", True),
        ("tcp://127.0.0.1;10.0.0.1:5", True),
        ("udp://127.0.0.1:5", True),
        ("", True),
    ],
)
def test_endpoints_beyond_the_loopback_require_keys(endpoint, required):
    assert require_curve(endpoint) is required


def test_only_an_authorized_client_of_the_true_server_is_answered(serving, keys, far):
    curve = server_curve(keys)
    alice, mallory = client_curve("alice", keys), client_curve("mallory", keys)
    with serving(TCP, curve=curve) as server:
        with Client(server.endpoint, 10.0, alice, far) as client:
            assert client.call("ping")["pid"] == os.getpid()
        with (
            Client(server.endpoint, 0.3, mallory, far) as client,
            pytest.raises(UserError, match="does not know our key"),
        ):
            client.call("ping")
        with Client(server.endpoint, 0.3, None, far) as client, pytest.raises(UserError, match="no daemon answers"):
            client.call("ping")
        false_server = ClientCurve(alice.keys, mallory.keys.public)
        with Client(server.endpoint, 0.3, false_server, far) as client, pytest.raises(UserError):
            client.call("ping")
        with Client(server.endpoint, 10.0, alice, far) as client:
            assert client.call("ping")["pid"] == os.getpid()
        assert (server.accepted, server.refused) == (2, {})


def test_two_servers_of_one_context_have_separate_authorized_lists(serving, keys, far):
    shutil.copy(keys / "mallory.key", keys / "authorized")
    both = server_curve(keys)
    (keys / "authorized/alice.key").unlink()
    only_mallory = server_curve(keys)
    alice = client_curve("alice", keys)
    with serving(TCP, curve=both) as first, serving(TCP, curve=only_mallory) as second:
        with Client(first.endpoint, 10.0, alice, far) as client:
            client.call("ping")
        with Client(second.endpoint, 0.3, alice, far) as client, pytest.raises(UserError):
            client.call("ping")


def test_context_with_keys_terminates_cleanly(keys, echo):
    code = f"""
import zmq
from pathlib import Path
from rtctl.daemon.keys import server_curve
from rtctl.daemon.server import CommandServer
context = zmq.Context()
server = CommandServer("{TCP}", None, context, server_curve(Path("{keys}")))
server.close()
context.term()
left_open = CommandServer("{TCP}", None, zmq.Context.instance(), server_curve(Path("{keys}")))
print("done")
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert ended.stdout.strip() == "done"
