"""The mailbox from the supervisor to the loop: parameters and commands, swapped in at the start of a tick.

A sequence lock: the count is odd while the supervisor writes. The loop never waits: a mailbox that is being written,
or that changed while it was copied, is left for the next tick.
"""

import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl.idiom import state, tick
from rtctl.laws.reference import SETPOINT
from rtctl.tick.faults import FAULT, SLOTS
from rtctl.tick.memory import Segment, fence

COMMAND = state(
    stop=int,  # 1: outputs to zero, then end
    arm=int,  # each counts up: a new count is a new request
    disarm=int,
    reset=int,
    gains=int,  # counts up where parameters changed, so that the law takes them over without a jump
    play=int,  # play the reference table from its start
    table=int,  # which of the two tables is in force
    commander_lost=int,  # 1 while `require_commander` finds nobody
    setpoint=SETPOINT,
    order=int,  # number of this post, which every row carries
    faulty=int,  # faults in the slots below
    faults=(FAULT, SLOTS),
)


def mailbox_dtype(params: np.dtype) -> np.dtype:
    """Record of the mailbox for a tick with these params; written by the supervisor but for `seen`."""
    return np.dtype([("count", np.int64), ("seen", np.int64), ("params", params), ("command", COMMAND)], align=True)


@tick
def take(box, staged, p, c):
    """Copy new parameters and commands into the loop's own `p` and `c`; returns 1 where there were any."""
    count = box[0].count
    if count == box[0].seen or count % 2 == 1:
        return 0
    fence()
    staged[0] = box[0]
    fence()
    if box[0].count != count:
        return 0
    p[0] = staged[0].params
    c[0] = staged[0].command
    box[0].seen = count
    return 1


class Mailbox:
    """The supervisor's end."""

    def __init__(self, segment: Segment):
        self._box = segment["mailbox"][0]

    def post(self, write: Callable[[Any, Any], None]) -> int:
        """Let `write(params, command)` change the records; returns the count that `seen` will reach.

        The post gets a number, `command.order`.
        """
        self._box["count"] += 1
        fence_python()
        write(self._box["params"], self._box["command"])
        self._box["command"]["order"] += 1
        fence_python()
        self._box["count"] += 1
        return int(self._box["count"])

    @property
    def seen(self) -> int:
        return int(self._box["seen"])


_lock = threading.Lock()


def fence_python() -> None:
    """A fence of the supervisor's: to take a lock and give it back orders memory, by POSIX, and compiles nothing."""
    with _lock:
        pass
