"""The mailbox from the supervisor to the loop: parameters and commands, copied at the start of a tick.

The mailbox has a sequence lock: the count is odd while the supervisor writes. The loop never waits. A mailbox that is
being written, or that changed during the copy, is read in the next tick.
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
    arm=int,  # request counter: a new count is a new request; so are disarm and reset
    disarm=int,
    reset=int,
    gains=int,  # counts up when parameters have changed, for a bumpless transfer in the law
    play=int,  # play the reference table from its start
    table=int,  # index of the table in force, 0 or 1
    commander_lost=int,  # 1 while a required commander is silent, on virtual time
    setpoint=SETPOINT,
    order=int,  # number of this post, written to every row
    faulty=int,  # number of fault slots in use
    faults=(FAULT, SLOTS),
)


def mailbox_dtype(params: np.dtype) -> np.dtype:
    """Dtype of the mailbox for a tick with these parameters. The supervisor writes all fields except `seen`."""
    return np.dtype([("count", np.int64), ("seen", np.int64), ("params", params), ("command", COMMAND)], align=True)


@tick
def take(box, staged, p, c):
    """Copy new parameters and commands into the loop's `p` and `c`; returns 1 if there were any, else 0."""
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
    """The supervisor's end of the mailbox."""

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
    """Memory fence for Python code: by POSIX, acquiring and releasing a lock orders memory. Needs no compilation."""
    with _lock:
        pass
