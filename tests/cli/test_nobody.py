"""Error messages of commands when no machine runs."""

import socket

import pytest

COMMANDS = [
    *(["status"], ["arm"], ["disarm"], ["reset"], ["play"], ["stop"]),
    *(["setpoint", "1mm"], ["get", "name"], ["set", "name", "x"], ["capture", "--for", "1s"]),
]


@pytest.fixture(autouse=True)
def _nobody(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_command_without_a_machine_says_how_to_start_one(rtctl, words):
    assert rtctl(*words) == (2, "", "rtctl: no machine runs here; start one with `rtctl run CONFIG`\n")
    code, _, err = rtctl(words[0], "--name", "ivu", *words[1:])
    assert code == 2
    assert err == "rtctl: no machine 'ivu' runs here; start it with `rtctl run`\n"


def test_socket_left_by_a_crash_counts_as_no_machine(rtctl, tmp_path):
    (tmp_path / "rtctl").mkdir()
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(tmp_path / "rtctl" / "ivu.command"))
    code, _, err = rtctl("status")
    assert code == 2
    assert "no machine runs here" in err


def test_network_address_needs_keys(rtctl, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    code, _, err = rtctl("status", "--name", "tcp://192.0.2.1:5571")
    assert code == 2
    assert "rtctl keys new client" in err
