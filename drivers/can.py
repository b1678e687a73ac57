"""Board of drives on a CAN bus with ODrive's CANSimple, through SocketCAN.

Each node gets a torque or a speed, and returns position, speed, current and torque. A drive is in closed loop control
(torque or velocity mode, input 0 at first) while the machine is on, and idle otherwise. The run ends with every input
at zero and every node idle if a node does not answer within `timeout`, leaves closed loop control, reports an error, or
sends an invalid message.

Source: see can_simple.py; Linux, Documentation/networking/can.rst for the sockets.
Never run on a drive: see docs/hardware.md.
"""

import errno
import os
import socket
import time
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from rtctl.config.errors import UserError, nearest
from rtctl.drivers import can_simple as can
from rtctl.drivers import daq_stc
from rtctl.drivers.board import BoardError, Wiring
from rtctl.drivers.bus import BusBoard
from rtctl.drivers.can_words import bus_words, error_words, state_words
from rtctl.idiom import Settings, quantity

PREFIX = "unix:"  # of an interface that is a unix socket of packets, for a kernel without virtual CAN
HELLO = 1.0  # s to wait for the first heartbeat: ODrive sends one each 0.1 s
TRIES = 3  # attempts for the first answer
SILENT = 1.0  # s without a heartbeat, after which a node has failed
ENTERING = 1.0  # s for a node to enter closed loop control
INPUTS = {"torque": (can.INPUT_TORQUE, can.TORQUE_CONTROL), "velocity": (can.INPUT_VELOCITY, can.VELOCITY_CONTROL)}
SHOWS = {  # quantity of a sensor -> message with it, and field of NODE
    "position": (can.ENCODER, "position"),
    "speed": (can.ENCODER, "speed"),
    "current": (can.IQ, "current"),
    "force": (can.TORQUES, "torque"),
}
NAMES = {can.ENCODER: "encoder estimates", can.IQ: "currents", can.TORQUES: "torques", can.HEARTBEAT: "a heartbeat"}
SECOND = 1_000_000_000
ERROR_FILTER, ALL_ERRORS = 2, 0x1FFFFFFF  # CAN_RAW_ERR_FILTER, CAN_ERR_MASK


class CanNodeSettings(Settings):
    """Node of a drive of the machine."""

    id: int = Field(ge=0, lt=can.NODES, description="node of the drive on the bus")
    input: Literal["torque", "velocity"] = Field("torque", description="what the drive is commanded with")
    scale: float = Field(1.0, description="Nm, or turns/s, for one unit of the machine's command; its sign is the way")


class CanSensorSettings(Settings):
    """Node and scale of a sensor of the machine."""

    id: int = Field(ge=0, lt=can.NODES, description="node that shows it")
    per_turn: float | None = Field(
        None,
        description="counts, rad or m of the sensor for one turn of the node's encoder; 1 turn where the body turns",
    )
    scale: float = Field(1.0, description="SI of the sensor for 1 A or 1 Nm, where it shows a current or a torque")


class CanSettings(Settings):
    """Settings of drives on a CAN bus with ODrive's CANSimple."""

    kind: Literal["can"] = "can"
    interface: str = Field("can0", description="SocketCAN interface, or unix:PATH for a socket with emulated nodes")
    nodes: dict[str, CanNodeSettings] = Field(description="node of each drive of the machine, by the drive's name")
    sensors: dict[str, CanSensorSettings] = Field(description="where each sensor of the machine comes from, by name")
    ask: bool = Field(True, description="ask for each message in each turn; else nodes send by themselves")
    timeout: float = quantity(0.02, unit="s", gt=0, le=1, help="oldest message that is acted on")
    rate: float | None = quantity(None, unit="Hz", gt=0, le=10e3, help="turns a second; as the loop's if absent")

    @property
    def place(self) -> str:
        """Interface, for messages."""
        return self.interface


class CanBoard(BusBoard):
    """Board of the nodes of a machine. `bus` is an open socket, for tests."""

    REASONS = {  # noqa: RUF012
        errno.ENOBUFS: "the interface's queue is full, nobody acknowledges; are power, wires, termination and bit rate "
        "right?",
        errno.ENETDOWN: "the interface is down",
        errno.EAGAIN: "the send queue of the interface is full",
    }

    def __init__(self, settings: CanSettings, wiring: Wiring, rate: float, bus: socket.socket | None = None) -> None:
        super().__init__(wiring)
        self.settings = settings
        self._given = bus
        self._socket: socket.socket | None = None
        self._patience = round(0.5 * SECOND / rate)
        check(settings, wiring)
        of = settings.nodes, settings.sensors
        self._ids = sorted({node.id for node in of[0].values()} | {sensor.id for sensor in of[1].values()})
        self._drives = [of[0][name] for name in wiring.drives]
        self._sensors = [
            (name, of[1][name], measures, factor(name, of[1][name], measures, turn))
            for name, measures, turn in zip(wiring.sensors, wiring.measures, wiring.turns, strict=True)
        ]
        wanted = {(self._ids.index(s.id), SHOWS[measures][0]) for _, s, measures, _ in self._sensors}
        self._wanted = np.array(sorted(wanted), np.int64).reshape(-1, 2)
        self._bus, self._nodes = np.zeros(1, can.BUS)[0], np.zeros(len(self._ids), can.NODE)
        self._zero = np.zeros(wiring.counters)
        self._on_since: int | None = None  # ns; None while the drives are off

    @property
    def name(self) -> str:
        return f"CANSimple at {self.settings.interface}"

    # Methods of Board

    def _open(self) -> None:
        _compile(self._nodes, self._wanted)
        self._socket = self._given or connect(self.settings.interface)
        self._bus["fd"], self._bus["garbled"], self._bus["errors"] = self._socket.fileno(), -1, 0
        self._nodes[:] = 0
        self._nodes["id"] = self._ids
        try:
            self._prepare()
        except BoardError as error:
            raise UserError(f"driver: {error}") from error
        for n, node in enumerate(self._nodes):
            if not node["heartbeat_at"]:
                raise UserError(
                    f"driver: {self._who(n)} sends no heartbeat at {self.settings.interface} within {HELLO:g} s; is it "
                    "powered, is its id right, its bit rate that of the interface, the bus terminated at both ends?"
                )
            if node["error"]:
                raise UserError(
                    f"driver: {self._who(n)} has an error: {error_words(int(node['error']))}; see odrivetool"
                )
        self._first_sample()

    def _prepare(self) -> None:
        """Set inputs to zero and nodes idle first, then clear errors, set modes, and wait for heartbeats."""
        self.zero()
        for node in self._ids:
            self._sent(can.send(self._bus, node << 5 | can.CLEAR_ERRORS, 1, 0, 0), f"node {node}: clear errors")
        for drive in self._drives:
            mode = INPUTS[drive.input][1]
            self._sent(
                can.send(self._bus, drive.id << 5 | can.CONTROLLER_MODE, 8, mode, can.PASSTHROUGH),
                f"node {drive.id}: controller mode",
            )
        nodes, begun = self._nodes, time.monotonic_ns()
        while time.monotonic_ns() - begun < HELLO * SECOND:  # heartbeats report an error until it is cleared
            self._received(can.sample(self._bus, nodes, self._wanted, 0, 0))
            if (nodes["heartbeat_at"] > 0).all() and not nodes["error"].any():
                return
            time.sleep(1e-3)

    def _first_sample(self) -> None:
        """Receive every message once; the current position becomes the zero of the counters."""
        took = []
        for _ in range(TRIES if self.settings.ask else 1):  # more than once: a busy computer may delay an answer
            begun = time.monotonic_ns()
            self._received(
                can.sample(self._bus, self._nodes, self._wanted, int(self.settings.ask), round(HELLO * SECOND))
            )
            while (late := self._missing(begun)) and time.monotonic_ns() - begun < HELLO * SECOND:
                self._received(can.sample(self._bus, self._nodes, self._wanted, 0, 0))
                time.sleep(1e-3)
            if late:
                n, command = late[0]
                how = "answers no request for" if self.settings.ask else "does not send"
                raise UserError(f"driver: {self._who(n)} {how} {NAMES[command]} within {HELLO:g} s")
            took.append((time.monotonic_ns() - begun) / SECOND)
        if self.settings.ask and min(took) > self.settings.timeout:
            raise UserError(
                f"driver: the nodes answer after {min(took) * 1e3:.0f} ms, and driver.timeout is "
                f"{self.settings.timeout * 1e3:g} ms; a faster bus, fewer nodes on it, or a longer time-out"
            )
        self._zero = self._values()[: self.wiring.counters]

    def _missing(self, since: int) -> list[tuple[int, int]]:
        """Pairs (index of the node, command) of wanted messages that have not come since `since`, ns."""
        return [
            (n, c) for n, c in self._wanted.tolist() if can.came.py_func(self._nodes.view(np.recarray)[n], c) < since
        ]

    def _values(self) -> np.ndarray:
        """Readings (n,) of the sensors in counts or SI, counters first, from the newest messages."""
        values = np.empty(len(self._sensors))
        for n, (_, sensor, measures, scale) in enumerate(self._sensors):
            values[n] = scale * self._nodes[self._ids.index(sensor.id)][SHOWS[measures][1]]
        return values

    def _read_all(self) -> np.ndarray:
        self._received(can.sample(self._bus, self._nodes, self._wanted, int(self.settings.ask), self._patience))
        self._look()
        return self._values()

    def _read_counts(self) -> Sequence[int]:
        self._latest = self._read_all()
        counts = np.rint(self._latest[: self.wiring.counters] - self._zero).astype(int)
        return [daq_stc.INITIAL_COUNT + int(n) for n in counts]

    def _read_volts(self) -> Sequence[float]:
        return [float(value) for value in self._latest[self.wiring.counters :]]

    def _write_code(self, n: int, code: int) -> None:
        drive, p = self._drives[n], self.outputs[n]
        value = drive.scale * code * p.volts_per_code
        self._sent(can.drive(self._bus, drive.id, INPUTS[drive.input][0], value), f"{self._drive(n)}: its input")

    def _write_lines(self, bits: int) -> None:
        raise AssertionError("a machine with digital lines is refused before")

    def enable(self, on: bool) -> None:
        """Request closed loop control, or idle. Raises BoardError where the request cannot be sent."""
        with self._guarded():
            self._on_since = time.monotonic_ns() if on else None
            for n in range(len(self._drives)):
                self._request_state(n, can.CLOSED_LOOP if on else can.IDLE)

    def zero(self) -> None:
        """Set inputs to zero and nodes idle. Raises BoardError after trying all of them."""
        self._on_since = None
        troubles = []
        for n in range(len(self._drives)):
            try:
                self._write_code(n, 0)
                self._request_state(n, can.IDLE)
            except BoardError as error:
                troubles.append(str(error))
        if troubles:
            raise BoardError("; ".join(troubles))

    def _close(self) -> None:
        if self._socket is not None and self._given is None:
            self._socket.close()
        self._socket = None

    # Bus access, with errors as messages

    def _request_state(self, n: int, state: int) -> None:
        node = self._drives[n].id
        self._sent(can.send(self._bus, node << 5 | can.SET_AXIS_STATE, 8, state, 0), f"{self._drive(n)}: its state")

    def _look(self) -> None:
        """Raise BoardError where a node is late, has an error, is in the wrong state, or sends an invalid message."""
        bus, now = self._bus, time.monotonic_ns()
        if bus["garbled"] >= 0:
            identifier, length = int(bus["garbled"]), int(bus["length"])
            bus["garbled"] = -1
            raise BoardError(
                f"{self.name}: node {identifier >> 5} sent {NAMES.get(identifier & 0x1F, 'a message')} "
                f"(0x{identifier:03X}) of {length} bytes, not valid in CANSimple; do two devices use this identifier?"
            )
        if bus["errors"]:
            errors = int(bus["errors"])
            bus["errors"] = 0
            if words := bus_words(errors):
                raise BoardError(f"{self.name}: {words}")
        for n, command in self._missing(now - round(self.settings.timeout * SECOND)):
            came = int(can.came.py_func(self._nodes.view(np.recarray)[n], command))
            raise BoardError(
                f"{self.name}: {self._who(n)} has sent no {NAMES[command].removeprefix('a ')} for "
                f"{(now - came) / 1e6:.0f} ms, and driver.timeout is {self.settings.timeout * 1e3:g} ms"
            )
        for n, node in enumerate(self._nodes):
            if now - node["heartbeat_at"] > SILENT * SECOND:
                raise BoardError(f"{self.name}: {self._who(n)} has sent no heartbeat for {SILENT:g} s")
            if node["error"]:
                raise BoardError(f"{self.name}: {self._who(n)} reports {error_words(int(node['error']))}")
        if self._on_since is None:
            return
        for n, drive in enumerate(self._drives):
            node = self._nodes[self._ids.index(drive.id)]
            if node["state"] == can.CLOSED_LOOP or node["heartbeat_at"] < self._on_since:
                continue
            if now - self._on_since > ENTERING * SECOND:
                raise BoardError(f"{self.name}: {self._drive(n)} is not in closed loop control but "
                                 f"{state_words(int(node['state']))}; was it calibrated?")  # fmt: skip

    def _who(self, n: int) -> str:
        """Text for node `n`: its id, and the names of its drives and sensors."""
        node = self._ids[n]
        of = [name for name in self.wiring.drives if self.settings.nodes[name].id == node]
        of += [name for name, sensor, *_ in self._sensors if sensor.id == node and name not in of]
        return f"node {node} ({', '.join(of)})"

    def _drive(self, n: int) -> str:
        return f"node {self._drives[n].id} ({self.wiring.drives[n]})"


def _compile(nodes: np.ndarray, wanted: np.ndarray) -> None:
    """Compile all functions before the run, by calls on an invalid socket."""
    bus = np.zeros(1, can.BUS)[0]
    bus["fd"] = -1
    can.send(bus, 0, 0, 0, 0)
    can.drive(bus, 0, can.INPUT_TORQUE, 0.0)
    can.sample(bus, nodes, wanted, 0, 0)


def check(settings: CanSettings, wiring: Wiring) -> None:
    """Raise UserError where the drives and sensors of the config do not match the machine."""
    if wiring.lines:
        raise UserError("driver: a CANSimple drive has no digital lines, and this machine writes "
                        f"{', '.join(map(str, wiring.lines))}; use driver.kind serial or a card")  # fmt: skip
    for key, given, there in (("nodes", settings.nodes, wiring.drives), ("sensors", settings.sensors, wiring.sensors)):
        for name in given:
            if name not in there:
                near = nearest(name, there)
                what = "drive" if key == "nodes" else "sensor"
                raise UserError(f"driver.{key}.{name}: the machine has no such {what}; "
                                + (f"did you mean '{near}'?" if near else f"it has {', '.join(there)}"))  # fmt: skip
        for name in there:
            if name not in given:
                raise UserError(f"driver.{key}.{name} is missing: say which node of the bus it is, {{id: 0}}")
    ids = [node.id for node in settings.nodes.values()]
    for node in sorted(set(ids)):
        if ids.count(node) > 1:
            raise UserError(f"driver.nodes: node {node} is given to two drives; each drive is a node of its own")
    for name, measures, known in zip(wiring.sensors, wiring.measures, wiring.turns, strict=True):
        factor(name, settings.sensors[name], measures, known)


def factor(name: str, sensor: CanSensorSettings, measures: str, turn: float | None) -> float:
    """Counts or SI units of a sensor per unit of the node's message. Raises UserError where they are not known."""
    if measures not in SHOWS:
        raise UserError(f"driver.sensors.{name}: no message of CANSimple shows the {measures} of this sensor; "
                        f"it has {', '.join(SHOWS)}")  # fmt: skip
    if measures in ("current", "force"):
        return sensor.scale
    found = sensor.per_turn if sensor.per_turn is not None else turn
    if found is None:
        raise UserError(f"driver.sensors.{name}.per_turn is missing: give the counts, or the metres, that this sensor "
                        "moves for one turn of the node's encoder")  # fmt: skip
    return found


def connect(interface: str) -> socket.socket:
    """Non-blocking socket at an interface. Raises UserError."""
    try:
        if interface.startswith(PREFIX):
            made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            made.connect(interface.removeprefix(PREFIX))
        else:
            made = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            made.setsockopt(socket.SOL_CAN_RAW, ERROR_FILTER, ALL_ERRORS)
            made.bind((interface,))
    except OSError as error:
        raise UserError(f"driver.interface: {_refusal(interface, error.errno or 0)}") from None
    made.setblocking(False)
    return made


def _refusal(interface: str, code: int) -> str:
    """Error message with remedy for an interface that cannot be opened."""
    if interface.startswith(PREFIX):
        return f"nothing listens at {interface.removeprefix(PREFIX)} ({os.strerror(code)})"
    if code == errno.ENODEV:
        return f"there is no {interface}; plug the adapter in, see `ip link show type can`"
    if code == errno.ENETDOWN:
        return f"{interface} is down; `sudo ip link set {interface} up type can bitrate 250000`"
    if code in (errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT):
        return f"this kernel has no CAN ({os.strerror(code)}); `sudo modprobe can_raw`, or {PREFIX}PATH to rehearse"
    if code in (errno.EACCES, errno.EPERM):
        return f"this account may not open {interface}"
    return f"{interface} does not open: {os.strerror(code)}"
