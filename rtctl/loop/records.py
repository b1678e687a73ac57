"""Records that the loop shares with the supervisor, and the layout of a machine's segment. Who writes is said here."""

import numpy as np

from rtctl.idiom import state
from rtctl.loop.histogram import HISTOGRAM
from rtctl.loop.mailbox import mailbox_dtype
from rtctl.loop.ring import RING
from rtctl.loop.shm_link import INPUTS_SLOT, OUTPUTS_SLOT

STATUS = state(
    # written by the loop
    pid=int,
    ready=int,  # 1 from the first tick on
    ended=int,
    tick=int,
    state=int,  # of the safety machine
    trip=int,
    trip_tick=int,
    missed=int,  # periods that went by without a tick
    late=int,  # ticks that woke later than `late` of a period
    overruns=int,  # ticks that were not done when the next was due
    first_ns=int,  # clock at the first tick
    link_frames=int,
    link_dropped=int,  # frames that could not be sent
    lost_counts=int,  # by the emulated quadrature converters
    failed=int,  # 1 where the plant stopped answering in lockstep
    lateness=HISTOGRAM,
    ticks=HISTOGRAM,  # driver, law, safety and ring
    exchange=HISTOGRAM,  # the link: sending and receiving
    age=HISTOGRAM,  # of the newest sample, when the tick reads it
    round_trip=HISTOGRAM,
    # written by the supervisor
    stop=int,  # 1: end at once, outputs to zero
    supervisor_lost=int,  # written by the loop's watch on the supervisor's pipe
)

PLANT_STATUS = state(
    pid=int, ready=int, ended=int, tick=int, stop=int, catch_ups=int, skipped=int, frames=int, ticks=HISTOGRAM
)


def layout(params: np.dtype, tables: np.dtype, row: np.dtype, rows: int) -> dict[str, tuple[np.dtype, int]]:
    """The segment of one machine: `rows` is the length of the ring."""
    return {
        "status": (STATUS, 1),
        "plant_status": (PLANT_STATUS, 1),
        "mailbox": (mailbox_dtype(params), 1),
        "outputs": (OUTPUTS_SLOT, 1),  # the link over shared memory: the loop writes
        "inputs": (INPUTS_SLOT, 1),  # the plant writes
        "tables": (tables, 2),  # the supervisor writes the one that is not in force
        "ring": (RING, 1),
        "rows": (row, rows),
    }
