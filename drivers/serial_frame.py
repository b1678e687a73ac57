"""Frame between rtctl and a microcontroller on a serial or USB line: compiled encoding and decoding.

    A5  kind  length  payload (length bytes)  CRC, two bytes, low one first

The CRC is CRC-16/CCITT-FALSE (polynomial 1021, start FFFF) over kind, length and payload. Numbers are little-endian,
floats IEEE 754 of 32 bits. docs/hardware.md has the table; examples/serial_board/rtctl_board.h is the other end in C.

    01 hello of the host      version, 2 bytes of time-out in ms
    81 hello of the device    version, outputs, inputs, counters, writable lines as bits, name (0 to 16 bytes)
    02 outputs of the host    number, on, lines, a float for each output
    82 sample of the device   number of the answered outputs, fault, lines, 4 bytes a counter, a float an input
"""

import numpy as np

from rtctl.drivers import posix
from rtctl.idiom import state, tick

SYNC, VERSION = 0xA5, 1
HELLO, HELLO_BACK, OUTPUTS, SAMPLE = 0x01, 0x81, 0x02, 0x82
MOST = 16  # most outputs, inputs and counters, each
HEAD, TAIL, LONGEST = 3, 2, 255  # bytes before, after and in the longest payload
FRAME = HEAD + LONGEST + TAIL  # bytes
ROOM = 4096  # bytes in one read

LINE = state(
    fd=int,
    wait=posix.WAIT_STATE,
    out=(np.uint8, FRAME),
    came=(np.uint8, ROOM),  # bytes as read
    frame=(np.uint8, FRAME),  # frame in assembly
    at=int,  # bytes in `frame`
    garbled=int,  # frames with a wrong checksum, length or kind, since the start
    number=int,  # number of the newest outputs
    sent_at=(int, 256),  # ns at which outputs were sent, by number
    answered=int,  # newest answered number, -1 for none
    answered_at=int,  # ns at which the answered outputs were sent
    heard_at=int,  # ns at which the newest answer came
    fault=int,  # fault of the device, 0 for none
    lines=int,
    hello=int,  # 1 once the device has sent its hello
    told=(np.uint8, LONGEST),  # payload of the device's hello
    told_length=int,
    counts=(np.uint32, MOST),
    inputs=(np.float32, MOST),
    outputs=(np.float32, MOST),
    counters=int,  # number of counters
    reads=int,  # number of inputs
    writes=int,  # number of outputs
)


@tick
def checksum(data, begin, end):
    """CRC-16/CCITT-FALSE of the bytes `begin` to `end` (not included) of an array."""
    crc = 0xFFFF
    for i in range(begin, end):
        crc ^= int(data[i]) << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021) & 0xFFFF if crc & 0x8000 != 0 else crc << 1 & 0xFFFF
    return crc


@tick
def word(line, at):
    """Unsigned number in four bytes of the received frame."""
    f = line.frame
    return int(f[at]) | int(f[at + 1]) << 8 | int(f[at + 2]) << 16 | int(f[at + 3]) << 24


@tick
def ship(line, kind, length):
    """Send a frame whose payload is in `line.out`; returns 0, or -errno where it cannot be sent in full."""
    line.out[0], line.out[1], line.out[2] = SYNC, kind, length
    crc = checksum(line.out, 1, HEAD + length)
    line.out[HEAD + length], line.out[HEAD + length + 1] = crc & 0xFF, crc >> 8
    size = HEAD + length + TAIL
    n = posix.write(line.fd, line.out, size)
    if n == size:
        return 0
    return n if n < 0 else posix.AGAIN


@tick
def say_hello(line, timeout_ms):
    """Send a hello with the time-out after which the device sets its outputs to zero."""
    line.out[3], line.out[4], line.out[5] = VERSION, timeout_ms & 0xFF, timeout_ms >> 8
    return ship(line, HELLO, 3)


@tick
def drive(line, on, lines):
    """Send `line.outputs` under the next number."""
    line.number = (line.number + 1) & 0xFF
    line.out[3], line.out[4], line.out[5] = line.number, on, lines
    for n in range(line.writes):
        bits = int(np.float32(line.outputs[n]).view(np.uint32))
        for i in range(4):
            line.out[6 + 4 * n + i] = bits >> (8 * i) & 0xFF
    line.sent_at[line.number] = posix.now(line.wait)
    return ship(line, OUTPUTS, 3 + 4 * line.writes)


@tick
def accept(line):
    """Store the values of a complete frame with the right checksum; a wrong length or kind counts as garbled."""
    kind, length = int(line.frame[1]), int(line.frame[2])
    if kind == HELLO_BACK:
        for i in range(length):
            line.told[i] = line.frame[HEAD + i]
        line.told_length, line.hello = length, 1
    elif kind == SAMPLE:
        if length != 3 + 4 * (line.counters + line.reads):
            line.garbled += 1
            return
        for n in range(line.reads):
            at = HEAD + 3 + 4 * (line.counters + n)
            line.inputs[n] = np.uint32(word(line, at)).view(np.float32)
        for n in range(line.counters):
            line.counts[n] = word(line, HEAD + 3 + 4 * n)
        line.answered, line.fault, line.lines = int(line.frame[3]), int(line.frame[4]), int(line.frame[5])
        line.answered_at, line.heard_at = max(line.answered_at, line.sent_at[line.answered]), posix.now(line.wait)
    else:
        line.garbled += 1


@tick
def put(line, byte):
    """Add the next byte of the line to the frame; a complete frame is checked and stored."""
    if line.at == 0 and byte != SYNC:
        return
    line.frame[line.at] = byte
    line.at += 1
    if line.at < HEAD:
        return
    end = HEAD + int(line.frame[2])
    if line.at < end + TAIL:
        return
    size, line.at = line.at, 0
    if checksum(line.frame, 1, end) == int(line.frame[end]) | int(line.frame[end + 1]) << 8:
        accept(line)
        return
    line.garbled += 1
    for i in range(1, size):  # the real frame may begin inside these bytes
        if line.frame[i] == SYNC:
            for k in range(i, size):
                line.frame[k - i] = line.frame[k]
            line.at = size - i
            if line.at >= HEAD and line.at >= HEAD + int(line.frame[2]) + TAIL:
                line.at = 0
            return


@tick
def drain(line):
    """Read the waiting bytes; returns 0, or -errno where the line fails."""
    n = posix.read(line.fd, line.came)
    if n == posix.AGAIN:
        return 0
    if n <= 0:
        return n if n < 0 else posix.GONE
    for i in range(n):
        put(line, int(line.came[i]))
    return 0


@tick
def sample(line, patience):
    """Wait at most `patience` ns for the answer to the newest outputs; returns 0, or -errno."""
    end = posix.now(line.wait) + patience
    result = drain(line)
    while result == 0 and line.answered != line.number:
        left = end - posix.now(line.wait)
        if left <= 0:
            break
        if posix.wait(line.wait, line.fd, left) > 0:
            result = drain(line)
    return result
