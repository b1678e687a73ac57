"""Emulated nodes that speak CANSimple at one end of a socket, written from ODrive's documents and not from our driver.

On a virtual CAN interface where the kernel has one, else on a pair of connected packet sockets.
"""

import contextlib
import select
import socket
import struct
import threading
import time
from types import SimpleNamespace

FRAME = struct.Struct("<IB3x8s")
RTR = 0x40000000
BEAT = 0.02  # s; default of ODrive: 0.1 s


class Nodes:
    """Nodes by id: `nodes[1].torque` is the last received torque, `nodes[1].position` the reported position, turns."""

    def __init__(self, bus: socket.socket, *ids: int) -> None:
        self.bus, self.lock, self.running = bus, threading.RLock(), True
        self.nodes = {
            n: SimpleNamespace(torque=0.0, speed_input=0.0, mode=None, state=1, error=0, position=0.0, speed=0.0,
                               current=0.0, estimate=0.0, silent=set(), short=set(), stubborn=False, delay=0.0)
            for n in ids
        }  # fmt: skip
        self.cleared = 0
        self.later: list[tuple[float, int, bytes]] = []
        bus.setblocking(False)
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def __getitem__(self, node: int) -> SimpleNamespace:
        self.pump()
        return self.nodes[node]

    def close(self) -> None:
        self.running = False
        self.thread.join()
        self.bus.close()

    def _run(self) -> None:
        beat = 0.0
        while self.running:
            if select.select([self.bus], [], [], 0.0005)[0]:
                self.pump()
            with self.lock:
                now = time.monotonic()
                for due in [each for each in self.later if each[0] <= now]:
                    self.later.remove(due)
                    self._put(due[1], due[2])
                if now - beat > BEAT:
                    beat = now
                    for n in self.nodes:
                        self.heartbeat(n)
                self.move(now)

    def move(self, now: float) -> None:
        """No motion by default; overridden by tests."""

    def heartbeat(self, n: int) -> None:
        node = self.nodes[n]
        if 0x01 not in node.silent:
            self._put(n << 5 | 0x01, struct.pack("<IBBBx", node.error, node.state, 0, 0))

    def pump(self) -> None:
        """Process received frames and answer them."""
        with self.lock:
            while True:
                try:
                    data = self.bus.recv(16)
                except (BlockingIOError, OSError):
                    return
                if len(data) != 16:
                    return
                identifier, length, payload = FRAME.unpack(data)
                self._take(identifier & 0x7FF, bool(identifier & RTR), payload[:length])

    def _take(self, identifier: int, remote: bool, data: bytes) -> None:
        n, command = identifier >> 5, identifier & 0x1F
        node = self.nodes.get(n)
        if node is None:
            return
        if remote:
            self._answer(n, node, command)
        elif command == 0x07:
            (wanted,) = struct.unpack("<I4x", data)
            node.state = node.state if node.stubborn and wanted == 8 else wanted
            node.torque = node.speed_input = 0.0
        elif command == 0x0B:
            node.mode = struct.unpack("<II", data)
        elif command == 0x0D:
            node.speed_input = struct.unpack("<ff", data)[0]
        elif command == 0x0E:
            node.torque = struct.unpack("<f4x", data)[0]
        elif command == 0x18:
            self.cleared += 1

    def _answer(self, n: int, node: SimpleNamespace, command: int) -> None:
        if command in node.silent:
            return
        values = {
            0x09: (node.position, node.speed), 0x14: (0.0, node.current), 0x1C: (0.0, node.estimate),
        }.get(command)  # fmt: skip
        if values is None:
            return
        data = struct.pack("<ff", *values)[: 4 if command in node.short else 8]
        if node.delay:
            self.later.append((time.monotonic() + node.delay, n << 5 | command, data))
        else:
            self._put(n << 5 | command, data)

    def send(self, n: int, command: int, data: bytes) -> None:
        """Send an unsolicited message."""
        with self.lock:
            self._put(n << 5 | command, data)

    def _put(self, identifier: int, data: bytes) -> None:
        with contextlib.suppress(OSError):
            self.bus.send(FRAME.pack(identifier, len(data), data.ljust(8, b"\0")))


def pair(interface: str = "vcan0") -> tuple[socket.socket, socket.socket]:
    """Both ends of a bus: a virtual CAN if available, otherwise two packet sockets."""
    try:
        ends = [socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) for _ in range(2)]
        for end in ends:
            end.bind((interface,))
    except (OSError, AttributeError):
        ends = list(socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET))
    for end in ends:
        end.setblocking(False)
    return ends[0], ends[1]
