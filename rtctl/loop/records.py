"""Records that the loop shares with the supervisor, with the writer of each field, and the layout of a segment."""

import numpy as np

from rtctl.idiom import state
from rtctl.loop.histogram import HISTOGRAM
from rtctl.loop.mailbox import mailbox_dtype
from rtctl.loop.ring import RING
from rtctl.loop.shm_link import INPUTS_SLOT, OUTPUTS_SLOT

LATEST = 64  # number of late ticks kept
LATE = state(tick=int, lateness=int)  # ns
MARKS = state(on=int, read=int, law=int)  # clock at the end of stages `read` and `law`, ns, if `on` is 1
STATUS = state(
    # written by the loop
    pid=int,
    ready=int,  # 1 from the first tick on
    ended=int,
    tick=int,
    state=int,  # of the safety machine
    trip=int,
    trip_tick=int,
    missed=int,  # periods without a tick
    late=int,  # ticks that woke later than the fraction `loop.late` of a period
    late_ticks=(LATE, LATEST),  # newest late ticks, in a circular buffer
    overruns=int,  # ticks that ended after the next was due
    first_ns=int,  # clock at the first tick
    link_frames=int,
    link_dropped=int,  # frames that could not be sent
    lost_counts=int,  # by the emulated quadrature converters
    failed=int,  # 1 where the plant stopped answering in lockstep
    lateness=HISTOGRAM,
    ticks=HISTOGRAM,  # read, law, write and publish
    read=HISTOGRAM,  # conversion of counters and inputs to signals
    law=HISTOGRAM,  # states, estimates, reference, law and safety
    write=HISTOGRAM,  # converters, and the row of the trace
    publish=HISTOGRAM,  # row into the ring, and this record
    exchange=HISTOGRAM,  # sending and receiving over the link
    age=HISTOGRAM,  # age of the newest sample when the tick reads it
    round_trip=HISTOGRAM,
    # written by the supervisor
    stop=int,  # 1: end at once, outputs to zero
    hold=int,  # tick before which virtual time waits for the supervisor; 0 for none
    heartbeat_ns=int,  # clock at the supervisor's latest turn; 0 without a supervisor
    commander_ns=int,  # clock at the latest sign of life of a commander
    supervisor_lost=int,  # 1 after the end of the supervisor's pipe; written by the loop's process
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
    watchdog=int,  # times that outputs were set to zero because no new ones came
)


def layout(params: np.dtype, tables: np.dtype, row: np.dtype, rows: int) -> dict[str, tuple[np.dtype, int]]:
    """Layout of a machine's segment, dtype and count of each record; `rows` is the length of the ring."""
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


STAGES = {  # stage of a tick, in order -> histogram of STATUS
    "wake": "lateness", "read": "read", "law": "law", "write": "write", "publish": "publish", "link": "exchange",
}  # fmt: skip


def late_ticks(status: np.void) -> list[dict[str, float]]:
    """The newest late ticks, oldest first, each with its lateness in us."""
    count = int(status["late"])
    kept = [status["late_ticks"][n % LATEST] for n in range(max(count - LATEST, 0), count)]
    return [{"tick": int(t["tick"]), "lateness_us": round(float(t["lateness"]) / 1000.0, 1)} for t in kept]
