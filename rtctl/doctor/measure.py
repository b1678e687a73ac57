"""Empty loop of rtctl and cyclictest in alternating windows, so that other load of the computer affects both."""

import subprocess
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.doctor import cyclictest
from rtctl.doctor.wakeup import Sleeper
from rtctl.loop import histogram
from rtctl.tick.clock import SECOND

ROUNDS = 5
MOST_LATE = 1e-3  # largest share of late ticks of a rate that is held


class Lateness(NamedTuple):
    """Lateness of a thread's wake-ups, over all windows of a rate."""

    ticks: int  # ticks due; for cyclictest its wake-ups
    late: int | None  # ticks later than half a period; None where the histogram ends before
    skipped: int | None  # ticks without a wake-up, after a late one; None where they are not counted
    us: dict[str, float]  # p50, p99, p999, max
    record: Any  # rtctl.loop.histogram.HISTOGRAM


class Rate(NamedTuple):
    """Lateness at one rate, in Hz."""

    hz: float
    ours: Lateness
    cyclictest: Lateness | None

    @property
    def late(self) -> int:
        """Ticks of rtctl's loop that came later than half a period, or not at all."""
        return (self.ours.late or 0) + (self.ours.skipped or 0)

    @property
    def held(self) -> bool:
        return self.late <= MOST_LATE * self.ours.ticks


class Measured(NamedTuple):
    rates: list[Rate]
    cpu: int
    priority: int
    window_s: int
    rounds: int
    lacks: list[str]  # refusals of the computer to rtctl's loop
    without: str | None  # why cyclictest was not run


def measure(
    rates: Sequence[float],
    seconds: int,
    cpu: int,
    priority: int,
    fifo: bool,
    lock: bool,
    say: Callable[[float, str], None],
) -> Measured:
    """Lateness at each rate, measured for about `seconds` by rtctl's loop and by cyclictest each.

    `say` gets the share done and a word. Without the right `lock` cyclictest does not lock memory; without SCHED_FIFO
    it does not run.
    """
    window = max(1, round(seconds / ROUNDS))
    rounds = max(1, round(seconds / window))
    without = cyclictest.missing() or (None if fifo else "cyclictest does not run without SCHED_FIFO")
    ours: dict[float, list[dict[str, Any]]] = {hz: [] for hz in rates}
    theirs: dict[float, list[cyclictest.Window]] = {hz: [] for hz in rates}
    say(0.0, "compiling")
    with Sleeper(cpu, priority) as sleeper, tempfile.TemporaryDirectory(prefix="rtctl-doctor-") as folder:
        for number in range(rounds):
            for place, hz in enumerate(rates):
                for who in ("rtctl", "cyclictest") if number % 2 == 0 else ("cyclictest", "rtctl"):
                    say((number + place / len(rates)) / rounds, f"{who} at {words(hz)}")
                    if who == "rtctl":
                        ours[hz].append(sleeper.window(round(SECOND / hz), window))
                    elif without is None:
                        try:
                            theirs[hz].append(cyclictest.run(hz, window, cpu, priority, Path(folder), lock))
                        except (subprocess.CalledProcessError, OSError, ValueError, KeyError) as error:
                            without = f"cyclictest did not run: {_last(error)}"
        lacks = sleeper.lacks
    say(1.0, "done")
    found = [Rate(hz, _ours(ours[hz]), _theirs(theirs[hz], hz) if without is None else None) for hz in rates]
    return Measured(found, cpu, priority, window, rounds, lacks, without)


def words(hz: float) -> str:
    """Text of a rate: 10 kHz, 500 Hz."""
    return f"{hz / 1000:g} kHz" if hz >= 1000 else f"{hz:g} Hz"


def _ours(windows: list[dict[str, Any]]) -> Lateness:
    record = np.zeros(1, histogram.HISTOGRAM)[0]
    for w in windows:
        record["bucket"][w["bucket"]] += np.array(w["count"], np.int64)
        record["count"] += sum(w["count"])
        record["max"] = max(record["max"], w["max"])
    skipped = sum(w["skipped"] for w in windows)
    late = sum(w["late"] for w in windows)
    return Lateness(int(record["count"]) + skipped, late, skipped, histogram.percentiles(record), record)


def _theirs(windows: list[cyclictest.Window], hz: float) -> Lateness:
    all_of_them = cyclictest.together(windows)
    record = np.zeros(1, histogram.HISTOGRAM)[0]
    bucket = np.searchsorted(edges(), all_of_them.ns, "right") - 1
    np.add.at(record["bucket"], bucket, all_of_them.hits)
    record["count"], record["max"] = all_of_them.wakeups, all_of_them.max_ns
    late = all_of_them.later_than(round(SECOND / hz / 2))
    return Lateness(all_of_them.wakeups, late, None, all_of_them.percentiles(), record)


def edges() -> np.ndarray:
    """Lower edges of the buckets of `rtctl.loop.histogram`, in ns, (BUCKETS,)."""
    index = np.arange(histogram.BUCKETS)
    octave = np.maximum(index // histogram.SUB - 1, 0)
    return np.where(index < histogram.SUB, index, (index - histogram.SUB * octave) << octave)


def _last(error: Exception) -> str:
    said = (getattr(error, "stderr", None) or str(error)).strip().splitlines()
    return said[-1] if said else repr(error)
