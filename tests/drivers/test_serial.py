"""A microcontroller as a board: bytes of the frame, the C code of the example, and faults of the device."""

import os
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.config.errors import UserError
from rtctl.drivers import serial
from rtctl.drivers import serial_frame as frame
from rtctl.drivers.at_mio_16de import AnalogOutputSettings
from rtctl.drivers.board import BoardError, Wiring
from rtctl.drivers.serial import SerialBoard, SerialSettings, connect
from rtctl.tick import frames

ONE = Wiring((AnalogOutputSettings(channel=0),), counters=1)


@pytest.fixture
def sample():
    return np.zeros(1, frames.INPUTS)[0]


@pytest.fixture
def bench(serial_library):
    """`bench(timeout=0.1)`: an open board and its device."""
    from serial_device import Device

    made = []

    def make(wiring=ONE, opened=True, prepare=lambda device: None, device=None, **settings):
        at = Device(serial_library, **(device or {}))
        prepare(at)
        card = SerialBoard(SerialSettings(**{"port": at.port, "timeout": 0.5, **settings}), wiring, 200.0)
        made.append((card, at))
        return (card.open() if opened else card), at

    yield make
    for card, at in made:
        card.close()
        at.close()


def until_it_fails(card, sample, seconds=5.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        card.write((100,), 0)
        card.read(sample)
    pytest.fail(f"nothing failed in {seconds} s")


def test_checksum_is_crc_16_ccitt_false():
    data = np.frombuffer(b"123456789", np.uint8)
    assert frame.checksum(data, 0, 9) == 0x29B1  # CRC-16/CCITT-FALSE's check value


def test_bytes_of_the_output_frame_are_those_of_the_manual():
    """A5 02 07, number 1, on, line 3, 1.5 as a float, and the checksum of the bytes after the first."""
    ours, theirs = os.pipe()
    line = np.zeros(1, frame.LINE)[0]
    line["fd"], line["writes"], line["outputs"][0] = theirs, 1, 1.5
    assert frame.drive(line, 1, 8) == 0
    data = os.read(ours, 99)
    assert data[:-2].hex(" ") == "a5 02 07 01 01 08 00 00 c0 3f"
    assert int.from_bytes(data[-2:], "little") == frame.checksum(np.frombuffer(data, np.uint8), 1, len(data) - 2)
    os.close(ours), os.close(theirs)


@given(noise=st.binary(max_size=40), cut=st.integers(0, 20))
def test_frame_is_found_in_noise(noise, cut):
    """After any preceding bytes, at the latest the second of two complete frames is found."""
    line = np.zeros(1, frame.LINE)[0]
    line["counters"] = 1
    whole = bytes([0x82, 7, 9, 0, 0, 1, 2, 3, 4])
    crc = frame.checksum(np.frombuffer(whole, np.uint8), 0, len(whole))
    whole = b"\xa5" + whole + crc.to_bytes(2, "little")
    for byte in noise + whole[:cut] + whole * 30:
        frame.put(line, byte)
    assert (line["answered"], line["counts"][0]) == (9, 0x04030201)


def test_device_name_is_reported(bench):
    card, _ = bench(device={"name": b"bench 7"})
    assert card.name.endswith("(bench 7)")


def test_device_receives_the_on_state_of_the_machine(bench, sample):
    card, device = bench()
    for on in (1, 0):
        card.enable(bool(on))
        card.write((1024,), 0)
        board = device.told(int(card._line["number"]))
        assert (board.on, board.output[0]) == (on, 5.0)


def test_device_zeroes_its_outputs_after_a_timeout(bench):
    """No more writes, as after a crash of the computer."""
    card, device = bench(timeout=0.3)
    card.enable(True)
    card.write((1024,), 0)
    assert device.told(int(card._line["number"])).output[0] == 5.0
    end = time.monotonic() + 5
    while device.board.output[0] and time.monotonic() < end:
        time.sleep(0.01)
    assert (device.board.output[0], device.board.on) == (0.0, 0)


def silent(device):
    device.silent = True


def late(device):
    device.delay = 0.6


def garbled(device):
    device.spoil = lambda reply: reply[:4] + bytes([reply[4] ^ 0x40]) + reply[5:]


def faulty(device):
    device.board.fault = 3


def not_a_number(device):
    device.board.input[0] = float("nan")


def unplugged(device):
    device.unplug()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (silent, r"the device has not answered for [3-9]\d\d ms, and driver.timeout is 300 ms"),
        (late, r"the device answers late: its newest sample is for outputs of [3-9]\d\d ms ago|has not answered for"),
        (
            garbled,
            r"the device has not answered for [3-9]\d\d ms.*; \d+ frames came garbled: check baud, ground and cable",
        ),
        (faulty, r"the device reports fault 3; its firmware says which"),
        (unplugged, r"could not be sent: the port is gone; was the device pulled out\?|received: the port is gone"),
    ],
)
def test_faulty_device_ends_the_board(bench, sample, spoil, words):
    card, device = bench(timeout=0.3)
    card.enable(True)
    card.write((1000,), 0)
    card.read(sample)
    spoil(device)
    with pytest.raises(BoardError, match=words) as error:
        until_it_fails(card, sample)
    assert card.failed is error.value
    if device.running:
        board = device.told(int(card._line["number"]))
        assert (board.output[0], board.on) == (0.0, 0)


def version(device):
    device.spoil = lambda reply: _resealed(reply[:3] + b"\x09" + reply[4:-2])


def _resealed(body):
    crc = frame.checksum(np.frombuffer(body, np.uint8), 1, len(body))
    return body + crc.to_bytes(2, "little")


@pytest.mark.parametrize(
    ("prepare", "device", "words"),
    [
        (silent, {}, r"driver.port: /dev/pts/\d+ does not answer within 0.7 s; does the device run the firmware"),
        (garbled, {}, r"driver.port: /dev/pts/\d+ sends bytes that are no rtctl frame within 0.7 s"),
        (version, {}, r"the device speaks version 9 of the frame, not 1"),
        (lambda device: None, {"outputs": 2}, r"has 2 outputs and the machine has 1; set the same number"),
        (lambda device: None, {"counters": 0}, r"has 0 counters and the machine has 1"),
    ],
)
def test_device_that_does_not_fit_the_machine_is_refused(bench, monkeypatch, prepare, device, words):
    monkeypatch.setattr(serial, "HELLO", 0.7)
    with pytest.raises(UserError, match=words):
        bench(prepare=prepare, device=device)


def test_lines_that_the_device_cannot_write_are_refused(bench):
    with pytest.raises(UserError, match="cannot write line 2"):
        bench(ONE._replace(lines=(0, 2)), device={"lines": 0b1})


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"port": "/dev/ttyNONE9"}, r"driver.port: there is no /dev/ttyNONE9; plug the device in"),
        ({"port": "/dev/null"}, r"driver.port: /dev/null is no serial line"),
        ({"baud": 12345}, r"driver.baud: 12345 is no rate of a serial line here; there is 9600,"),
    ],
)
def test_unavailable_port_is_an_error(settings, words):
    with pytest.raises(UserError, match=words):
        connect(SerialSettings(**settings))
