"""Run of a machine with a fault, and its outcome."""

import math
from typing import Any, NamedTuple

import numpy as np

from rtctl.faults.cases import Case, Stand
from rtctl.faults.drives import Inside, Processes, again
from rtctl.tick import safety
from rtctl.tick.faults import KINDS


class Outcome(NamedTuple):
    """Outcome of a fault. Counts in ticks; None for an event that did not occur."""

    machine: str
    fault: str
    channel: int
    size: float
    trip: str | None
    detected: int | None  # ticks from the fault to the trip
    safe: int | None  # ticks from the fault to the first of the lasting zeros at the outputs
    safe_from_trip: int | None  # ticks from the trip to the lasting zeros
    wire: bool | None  # whether the DAC had zeros before the end of the fault; None without a trip
    error: float  # largest following error during the fault and before a trip, rad or m
    allowed: float  # limit of the following error, rad or m
    late: int  # late ticks
    lost: int  # lost rows
    same: bool  # whether all rows before the fault equal those of the undisturbed run, to the bit
    again: bool  # whether the machine moved again after reset and arm


def undisturbed(stand: Stand) -> Any:
    """Rows of the run without a fault, equal to the bit in every mode of virtual time."""
    with Inside(stand.config(loop__mode="fused"), stand.ticks(stand.last)) as drive:
        drive.to(stand.ticks(stand.last))
        return drive.rows().copy()


def play(stand: Stand, case: Case, drive: Inside | Processes, truth: Any) -> Outcome:
    """Outcome of the run of a stand with a fault in its config; `truth` are the rows of the undisturbed run."""
    begin, end = stand.ticks(stand.begin), stand.ticks(stand.begin + stand.lasts)
    restart, last = stand.ticks(stand.again), stand.ticks(stand.last)
    drive.to(end - 1)
    wire = not any(drive.wire())
    drive.to(restart)
    drive.post(again)
    drive.to(last)
    rows = drive.rows()
    trips = np.flatnonzero(np.asarray(rows["state"][begin:restart]) == safety.TRIPPED)
    k = begin + int(trips[0]) if trips.size else None
    error = np.abs(rows[stand.error][begin : k if k is not None else end])
    config = stand.config([stand.fault(case)])
    quiet = None if k is None else k + _quiet(stand, rows, k, restart)
    ticks = np.asarray(rows["tick"])
    return Outcome(
        machine=stand.name,
        fault=case.fault,
        channel=case.channel,
        size=KINDS[case.fault].usual if case.size is None else case.size,
        trip=None if k is None else safety.TRIPS[int(rows["trip"][k])][0],
        detected=None if k is None else k - begin,
        safe=None if quiet is None else quiet - begin,
        safe_from_trip=None if k is None or quiet is None else quiet - k,
        wire=None if k is None or k >= end - 1 else wire,
        error=float(error.max()) if error.size else 0.0,
        allowed=float(config.safety.following_error),
        late=int(np.count_nonzero(np.asarray(rows["lateness"]) > 0.0)),
        lost=last - len(ticks),
        same=same(rows, truth, begin),
        again=_runs(stand, rows, restart, last),
    )


def same(rows: Any, truth: Any, ticks: int) -> bool:
    """Whether the first `ticks` rows equal those of the undisturbed run in every column, to the bit."""
    return len(rows["tick"]) >= ticks and all(
        np.array_equal(rows[name][:ticks], truth[name][:ticks], equal_nan=True) for name in truth.dtype.names
    )


def _quiet(stand: Stand, rows: Any, first: int, end: int) -> int:
    """Number of ticks from `first` to the lasting zeros at the outputs before `end`."""
    on = np.any([np.asarray(rows[name][first:end]) != 0.0 for name in stand.outputs], axis=0)
    return int(np.flatnonzero(on)[-1]) + 1 if on.any() else 0


def _runs(stand: Stand, rows: Any, restart: int, last: int) -> bool:
    """Whether the machine runs to the end and has followed its reference since the restart."""
    moved = np.ptp(np.asarray(rows["ref"][restart:last]) - np.asarray(rows[stand.error][restart:last]))
    following = math.fabs(float(rows[stand.error][last - 1])) < stand.config().safety.following_error
    return bool(rows["state"][last - 1] == safety.RUNNING and moved > stand.move and following)
