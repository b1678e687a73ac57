"""The link over ZeroMQ, called from compiled code: one DEALER socket at each end; the newest frame is used.

The sockets are made and secured in Python (pyzmq); the tick gets their handles. Sending never blocks: without a plant
frames are lost, but no time. `load()` makes the libzmq inside the pyzmq wheel known to the compiler.

Source: zmq_send(3), zmq_recv(3); thread safety: the handle stays with the thread that runs the loop.
"""

from pathlib import Path
from typing import Any

import llvmlite.binding
import zmq
from numba import types

from rtctl.idiom import tick
from rtctl.tick import frames

DONTWAIT = 1
MOST = 64  # frames read in one tick, so that a flood of frames cannot delay the tick

zmq_send: Any = types.ExternalFunction("zmq_send", types.int32(types.intp, types.intp, types.uintp, types.int32))
zmq_recv: Any = types.ExternalFunction("zmq_recv", types.int32(types.intp, types.intp, types.uintp, types.int32))


def load() -> None:
    """Make libzmq's functions known to compiled code. Raises OSError where the wheel holds no libzmq."""
    root = Path(zmq.__file__).parent
    for folder in (root.parent / "pyzmq.libs", root, root / ".dylibs"):
        for found in folder.glob("libzmq*"):
            llvmlite.binding.load_library_permanently(str(found))
            return
    import ctypes.util

    name = ctypes.util.find_library("zmq")
    if name is None:
        raise OSError("libzmq was found neither inside pyzmq nor on the system; use link: {kind: shm}")
    llvmlite.binding.load_library_permanently(name)


@tick
def send(link, frame):
    """Send the record array `frame` (1,) without waiting; returns whether it was sent."""
    return zmq_send(link, frame.ctypes.data, frame.itemsize, DONTWAIT) == frame.itemsize


@tick
def receive_newest(link, frame, staged):
    """Read waiting frames, at most MOST, and keep the newest valid one in `frame`. Returns the number of valid ones."""
    fresh = 0
    for _ in range(MOST):
        length = zmq_recv(link, staged.ctypes.data, staged.itemsize, DONTWAIT)
        if length < 0:
            break
        if length == staged.itemsize and frames.valid(staged[0]):
            frame[0] = staged[0]
            fresh += 1
    return fresh


@tick
def receive(link, frame, staged):
    """Wait for the next valid frame, at most for the socket's time-out; returns 1, or 0 where none came."""
    for _ in range(MOST):
        length = zmq_recv(link, staged.ctypes.data, staged.itemsize, 0)
        if length < 0:
            return 0
        if length == staged.itemsize and frames.valid(staged[0]):
            frame[0] = staged[0]
            return 1
    return 0
