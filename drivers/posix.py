"""Non-blocking reads and writes of a file descriptor for compiled code. A failed call returns -errno.

Source: read(2), write(2), ppoll(2), clock_gettime(2), errno(3).
"""

import errno
from typing import Any

from numba import carray, types

from rtctl.idiom import state, tick

POLLIN = 1
AGAIN = -errno.EAGAIN
GONE = -errno.EPIPE  # a stream that has ended
SECOND = 1_000_000_000
CLOCK_MONOTONIC = 1

_read: Any = types.ExternalFunction("read", types.intp(types.int32, types.intp, types.uintp))
_write: Any = types.ExternalFunction("write", types.intp(types.int32, types.intp, types.uintp))
_ppoll: Any = types.ExternalFunction("ppoll", types.int32(types.intp, types.uintp, types.intp, types.intp))
_clock: Any = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.uintp))
_errno: Any = types.ExternalFunction("__errno_location", types.CPointer(types.int32)())

WAIT_STATE = state(polled=(int, 1), spec=(int, 2))  # pollfd and timespec


@tick
def now(s):
    """Time in ns of CLOCK_MONOTONIC, as time.monotonic_ns; drivers must not import rtctl.tick.clock."""
    _clock(CLOCK_MONOTONIC, s.spec.ctypes.data)
    return s.spec[0] * SECOND + s.spec[1]


@tick
def read(fd, buffer):
    """Read at most the size of the array `buffer`; returns the number of bytes, 0 at the end of a stream."""
    n = _read(fd, buffer.ctypes.data, buffer.size * buffer.itemsize)
    return n if n >= 0 else -int(carray(_errno(), 1)[0])


@tick
def write(fd, buffer, size):
    """Write the first `size` bytes of `buffer`; returns the number of bytes written."""
    n = _write(fd, buffer.ctypes.data, size)
    return n if n >= 0 else -int(carray(_errno(), 1)[0])


@tick
def wait(s, fd, nanoseconds):
    """Wait at most `nanoseconds` for data to read; returns 1, 0 after a time-out, or -errno."""
    s.polled[0] = fd | (POLLIN << 32)
    left = max(nanoseconds, 0)
    s.spec[0], s.spec[1] = left // SECOND, left % SECOND
    n = _ppoll(s.polled.ctypes.data, 1, s.spec.ctypes.data, 0)
    return n if n >= 0 else -int(carray(_errno(), 1)[0])
