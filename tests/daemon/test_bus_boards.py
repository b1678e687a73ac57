"""Machines on a bus in real time: emulated moving nodes, a run without a trip, and a node that stops sending."""

import contextlib
import os
import socket
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from rtctl.cli import common
from rtctl.daemon.session import Session
from rtctl.trace.bundle import load_bundle

sys.path.insert(0, str(Path(__file__).parents[1] / "drivers"))
import serial_device
from odrive_nodes import Nodes

INERTIA, DRAG = 2.4e-4, 1e-3  # kg m^2, Nm s/rad, as in configs/boards/
pytestmark = pytest.mark.realtime


class Motor:
    """A rotor with drag, integrated over wall-clock time."""

    def __init__(self) -> None:
        self.angle = self.speed = 0.0
        self.at: float | None = None

    def move(self, torque: float, now: float) -> None:
        left, self.at = min(now - (self.at or now), 0.05), now
        while left > 0.0:
            h = min(left, 5e-4)
            self.speed += h * (torque - DRAG * self.speed) / INERTIA
            self.angle += h * self.speed
            left -= h


class Drive(Nodes):
    """An ODrive with a motor. The bus is a socket, since a kernel need not have a virtual CAN."""

    def __init__(self, bus: socket.socket) -> None:
        self.motor = Motor()
        super().__init__(bus, 1)

    def move(self, now: float) -> None:
        node = self.nodes[1]
        self.motor.move(node.torque if node.state == 8 else 0.0, now)
        node.position, node.speed = self.motor.angle / (2 * np.pi), self.motor.speed / (2 * np.pi)


class Micro(serial_device.Device):
    """A microcontroller with an H-bridge and a DC motor: 0.05 Nm/A and 1 ohm."""

    def __init__(self, lib) -> None:
        self.motor = Motor()
        super().__init__(lib)

    def move(self, now: float) -> None:
        volts = self.board.output[0] if self.board.on else 0.0
        self.motor.move(0.05 * (volts - 0.05 * self.motor.speed), now)
        self.board.counter[0] = round(self.motor.angle * 2400 / (2 * np.pi)) & 0xFFFFFFFF


@contextlib.contextmanager
def listening(path: Path):
    """Serve a drive for each connection; the newest drive is the last of the list."""
    drives: list[Drive] = []
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    listener.bind(str(path))
    listener.listen()
    listener.settimeout(0.05)
    running = True

    def serve() -> None:
        while running:
            with contextlib.suppress(TimeoutError):
                drives.append(Drive(listener.accept()[0]))

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield drives
    finally:
        running = False
        thread.join()
        listener.close()
        for drive in drives:
            drive.close()


def config(name: str, *changes: str):
    slack = (
        "safety.link_timeout=1 s",
        "safety.missed_ticks=0",
        "safety.following_error=1000",
        "driver.timeout=1 s",
        "loop.realtime=off",
        f"name={name}{os.getpid()}",
    )
    return common.load_config(f"boards/{name}", [*slack, *changes])


def test_axis_on_can_simple_follows_and_its_drive_is_idle_after_the_run(runtime, tmp_path):
    with listening(tmp_path / "bus") as drives:
        settings = config("axis_odrive", f"driver.interface=unix:{tmp_path / 'bus'}")
        result = Session(settings, tmp_path / "b", 2.0).run()
        assert result["tripped"] is None
        node = drives[-1].nodes[1]
        assert (node.state, node.torque, node.mode) == (1, 0.0, (1, 1))
    columns = load_bundle(tmp_path / "b").columns
    assert columns["feedback"].max() == pytest.approx(np.pi, abs=1.0)
    assert np.abs(columns["torque"]).max() > 0.01


def test_silent_can_node_trips_link_lost_and_is_named_in_the_output(runtime, tmp_path, capfd):
    with listening(tmp_path / "bus") as drives:
        settings = config("axis_odrive", f"driver.interface=unix:{tmp_path / 'bus'}", "driver.timeout=0.2 s")
        fall = threading.Timer(0.1, lambda: None)

        def silence() -> None:
            end = time.monotonic() + 60
            while time.monotonic() < end and not (drives and drives[-1].nodes[1].state == 8 and drives[-1].motor.speed):
                time.sleep(0.01)
            drives[-1].nodes[1].silent.add(0x09)

        fall = threading.Thread(target=silence)
        fall.start()
        result = Session(settings, tmp_path / "b", 5.0).run()
        fall.join()
        node = drives[-1].nodes[1]
        assert (node.state, node.torque) == (1, 0.0)
    assert result["tripped"] == "link_lost"
    told = capfd.readouterr()
    assert "node 1 (torque, encoder) has sent no encoder estimates for" in told.err + told.out


def test_axis_on_a_microcontroller_follows_without_a_trip(runtime, tmp_path):
    device = Micro(serial_device.library(tmp_path))
    try:
        settings = config("axis_serial", f"driver.port={device.port}")
        result = Session(settings, tmp_path / "b", 2.0).run()
        assert result["tripped"] is None and not device.board.on and device.board.output[0] == 0.0
    finally:
        device.close()
    columns = load_bundle(tmp_path / "b").columns
    assert columns["feedback"].max() == pytest.approx(np.pi, abs=1.0)
    assert np.abs(columns["volts"]).max() > 0.1
