"""ODrive's CANSimple, compiled: frames of SocketCAN to values of a node and back.

A frame is `struct can_frame` as four words: identifier with flags, length, and two words of data. The identifier is
`node << 5 | command`. Floats are IEEE 754 of 32 bits, all numbers little-endian; positions are turns, speeds turns/s.

Source: ODrive, docs/can-protocol.rst and Firmware/communication/can/can_simple.cpp (0.5.6); ODriveArduino,
ODriveEnums.h for the errors of 0.6; linux/can.h and linux/can/error.h.
"""

import math

import numpy as np

from rtctl.drivers import posix
from rtctl.idiom import state, tick

HEARTBEAT, SET_AXIS_STATE, ENCODER, CONTROLLER_MODE = 0x01, 0x07, 0x09, 0x0B
INPUT_VELOCITY, INPUT_TORQUE, IQ, CLEAR_ERRORS, TORQUES = 0x0D, 0x0E, 0x14, 0x18, 0x1C
IDLE, CLOSED_LOOP = 1, 8  # axis states
VELOCITY_CONTROL, TORQUE_CONTROL, PASSTHROUGH = 2, 1, 1
NODES = 64
EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000  # flags of an identifier
SIZE = 16  # bytes of a frame
MOST = 256  # frames read in one turn, so that a flood of frames cannot delay the turn

NODE = state(
    id=int,
    position=float,  # turns
    speed=float,  # turns/s
    current=float,  # A, measured
    torque=float,  # Nm, estimated
    error=int,  # error of the axis, from its newest heartbeat
    state=int,
    encoder_at=int,  # ns, time of the last message; 0 for none. So are the next three
    iq_at=int,
    torques_at=int,
    heartbeat_at=int,
)
BUS = state(
    fd=int,
    wait=posix.WAIT_STATE,
    frame=(np.uint32, 4),
    errors=int,  # bits of the newest error frame of the controller, 0 for none
    garbled=int,  # identifier of an invalid frame, -1 for none
    length=int,  # bytes of the invalid frame
)


@tick
def send(bus, identifier, length, first, second):
    """Send a frame of two words; returns 0, or -errno on failure."""
    bus.frame[0], bus.frame[1], bus.frame[2], bus.frame[3] = identifier, length, first, second
    n = posix.write(bus.fd, bus.frame, SIZE)
    return 0 if n == SIZE else n if n < 0 else posix.GONE


@tick
def bits(value):
    """Bits of a number as a 32-bit float."""
    return np.float32(value).view(np.uint32)


@tick
def number(word):
    """Value of a word as a 32-bit float."""
    return float(np.uint32(word).view(np.float32))


@tick
def drive(bus, node, command, value):
    """Send the input of a node: torque in Nm, or speed in turns/s without feedforward torque. 8 bytes, as ODrive."""
    return send(bus, node << 5 | command, 8, bits(value), 0)


@tick
def request(bus, node, command):
    """Ask a node for a message, by its identifier with the remote flag."""
    return send(bus, node << 5 | command | REMOTE, 0 if command == HEARTBEAT else 8, 0, 0)


@tick
def take(bus, nodes, now):
    """Store the values of the frame in `bus.frame` in its node. Other frames are ignored."""
    identifier, length = int(bus.frame[0]), int(bus.frame[1]) & 0xFF
    if identifier & ERROR != 0:
        bus.errors = identifier & 0x1FFFFFFF
        return
    if identifier & (EXTENDED | REMOTE) != 0:
        return
    command = identifier & 0x1F
    for n in range(len(nodes)):
        node = nodes[n]
        if node.id != identifier >> 5:
            continue
        if command == HEARTBEAT:
            if length < 5:
                bus.garbled, bus.length = identifier, length
                return
            node.error, node.state = int(bus.frame[2]), int(bus.frame[3]) & 0xFF
            node.heartbeat_at = now
        elif command in (ENCODER, IQ, TORQUES):
            first, second = number(bus.frame[2]), number(bus.frame[3])
            if length != 8 or not (math.isfinite(first) and math.isfinite(second)):
                bus.garbled, bus.length = identifier, length
                return
            if command == ENCODER:
                node.position, node.speed, node.encoder_at = first, second, now
            elif command == IQ:
                node.current, node.iq_at = second, now
            else:
                node.torque, node.torques_at = second, now
        return


@tick
def drain(bus, nodes):
    """Read all waiting frames, at most MOST; returns 0, or -errno where the bus fails."""
    for _ in range(MOST):
        n = posix.read(bus.fd, bus.frame)
        if n == posix.AGAIN:
            return 0
        if n <= 0:
            return n if n < 0 else posix.GONE
        if n == SIZE:
            take(bus, nodes, posix.now(bus.wait))
    return 0


@tick
def came(node, command):
    """Time at which a node's message last came, ns."""
    if command == ENCODER:
        return node.encoder_at
    if command == IQ:
        return node.iq_at
    return node.torques_at if command == TORQUES else node.heartbeat_at


@tick
def sample(bus, nodes, wanted, asked, patience):
    """Read waiting frames and, if `asked` is not 0, request the messages `wanted` and wait for them.

    `wanted` is (n, 2), rows of (index in `nodes`, command). The wait is at most `patience` ns. Returns 0, or -errno.
    """
    begun = posix.now(bus.wait)
    result = drain(bus, nodes)
    if asked != 0:
        for i in range(len(wanted)):
            if result == 0:
                result = request(bus, nodes[wanted[i, 0]].id, wanted[i, 1])
    while result == 0 and asked != 0:
        missing = 0
        for i in range(len(wanted)):
            if came(nodes[wanted[i, 0]], wanted[i, 1]) < begun:
                missing += 1
        left = begun + patience - posix.now(bus.wait)
        if missing == 0 or left <= 0:
            break
        posix.wait(bus.wait, bus.fd, left)
        result = drain(bus, nodes)
    return result
