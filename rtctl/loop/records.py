"""Records that the loop shares with the supervisor, and the layout of a machine's segment. Who writes is said here."""

import numpy as np

from rtctl.idiom import state
from rtctl.loop.histogram import HISTOGRAM
from rtctl.loop.mailbox import mailbox_dtype
from rtctl.loop.ring import RING
from rtctl.loop.shm_link import INPUTS_SLOT, OUTPUTS_SLOT

LATEST = 64  # late ticks that are remembered
LATE = state(tick=int, lateness=int)  # ns
MARKS = state(on=int, read=int, law=int)  # clock at the end of these stages, ns, where `on`
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
    late_ticks=(LATE, LATEST),  # the latest of them, in a circle
    overruns=int,  # ticks that were not done when the next was due
    first_ns=int,  # clock at the first tick
    link_frames=int,
    link_dropped=int,  # frames that could not be sent
    lost_counts=int,  # by the emulated quadrature converters
    failed=int,  # 1 where the plant stopped answering in lockstep
    lateness=HISTOGRAM,
    ticks=HISTOGRAM,  # read, law, write and publish
    read=HISTOGRAM,  # counters and inputs to what the law sees
    law=HISTOGRAM,  # states, estimates, reference, law and safety
    write=HISTOGRAM,  # converters, and the row of the trace
    publish=HISTOGRAM,  # the row into the ring, and these counts
    exchange=HISTOGRAM,  # the link: sending and receiving
    age=HISTOGRAM,  # of the newest sample, when the tick reads it
    round_trip=HISTOGRAM,
    # written by the supervisor
    stop=int,  # 1: end at once, outputs to zero
    hold=int,  # virtual time waits before this tick until the supervisor moves it; 0 for never
    heartbeat_ns=int,  # clock at the supervisor's latest turn; 0 where there is none
    commander_ns=int,  # clock at the latest word of a commander
    supervisor_lost=int,  # written by the loop's watch on the supervisor's pipe
)

PLANT_STATUS = state(
    pid=int,
    ready=int,
    ended=int,
    tick=int,
    stop=int,
    catch_ups=int,
    skipped=int,
    frames=int,
    ticks=HISTOGRAM,
    watchdog=int,  # times that the outputs were taken to zero because none came
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


STAGES = {  # of a tick, in their order -> histogram of STATUS
    "wake": "lateness", "read": "read", "law": "law", "write": "write", "publish": "publish", "link": "exchange",
}  # fmt: skip


def late_ticks(status: np.void) -> list[dict[str, float]]:
    """The latest late ticks, oldest first, with how late each woke in us."""
    count = int(status["late"])
    kept = [status["late_ticks"][n % LATEST] for n in range(max(count - LATEST, 0), count)]
    return [{"tick": int(t["tick"]), "lateness_us": round(float(t["lateness"]) / 1000.0, 1)} for t in kept]
