"""The link over shared memory: one slot in each direction, with a futex to wait on. Same computer only; 5 us.

A slot has a sequence lock: its count is odd while it is written. A reader takes the newest complete frame or none.

Source: futex(2).
"""

import platform
import sys
from typing import Any

import numpy as np
from numba import types

from rtctl.config.errors import UserError
from rtctl.idiom import tick
from rtctl.tick import frames
from rtctl.tick.memory import fence

FUTEX = {"x86_64": 202, "aarch64": 98}  # system call number, from the kernel's unistd.h of each architecture
SYS_FUTEX = FUTEX.get(platform.machine(), 0)
WAIT, WAKE = 0, 1
TIMEOUT_NS = 5_000_000_000  # longest wait for a frame

syscall: Any = types.ExternalFunction(
    "syscall", types.int64(types.int64, types.intp, types.int64, types.int64, types.intp, types.intp, types.int64)
)


def check_architecture(machine: str = platform.machine(), bits: int = sys.maxsize.bit_length() + 1) -> None:
    """Check that the system call numbers of this architecture are known. Raises UserError if not.

    `machine` is the name by uname(2), `bits` the width of an address in this Python.
    """
    if machine not in FUTEX or bits != 64:
        raise UserError(
            f"this processor is {machine} with a {bits}-bit Python; rtctl knows the system calls of 64-bit "
            f"{' and '.join(FUTEX)}: use a 64-bit system on one of them"
        )


def slot_dtype(frame: np.dtype) -> np.dtype:
    """Dtype of the slot of one direction. Its sender writes it, except `seen` and `wait`, which its receiver writes."""
    return np.dtype(
        [("count", np.int32), ("pad", np.int32), ("seen", np.int64), ("wait", np.int64, (2,)), ("frame", frame)],
        align=True,
    )


OUTPUTS_SLOT, INPUTS_SLOT = slot_dtype(frames.OUTPUTS), slot_dtype(frames.INPUTS)


@tick
def send(slot, frame):
    """Write the frame into the slot and wake its receiver."""
    slot[0].count += 1
    fence()
    slot[0].frame = frame[0]
    fence()
    slot[0].count += 1
    syscall(SYS_FUTEX, slot.ctypes.data, WAKE, 1, 0, 0, 0)  # `count` is the first field of the record
    return True


@tick
def receive_newest(slot, frame, staged):
    """Take the newest frame into `frame` (1,) without waiting; returns 1 if it is new and valid, else 0."""
    count = slot[0].count
    if count == slot[0].seen or count % 2 == 1:
        return 0
    fence()
    staged[0] = slot[0].frame
    fence()
    if slot[0].count != count:
        return 0
    slot[0].seen = count
    if not frames.valid(staged[0]):
        return 0
    frame[0] = staged[0]
    return 1


@tick
def receive(slot, frame, staged):
    """Wait for a new frame, at most 5 s; returns 1, or 0 where none came."""
    for _ in range(1000):
        if receive_newest(slot, frame, staged) == 1:
            return 1
        count = slot[0].count
        slot[0].wait[0] = TIMEOUT_NS // 1_000_000_000
        slot[0].wait[1] = 0
        none = count == slot[0].seen or count % 2 == 1  # no new frame yet, or one that is being written
        if none and syscall(SYS_FUTEX, slot.ctypes.data, WAIT, count, slot.wait.ctypes.data, 0, 0) < 0:
            if receive_newest(slot, frame, staged) == 1:
                return 1
            if slot[0].count == count:
                return 0
    return 0
