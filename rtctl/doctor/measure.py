"""Our empty loop and cyclictest in alternating windows, so that what the machine does meanwhile falls on both."""

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
MOST_LATE = 1e-3  # share of late ticks with which a rate still counts as held


class Lateness(NamedTuple):
    """How late a thread woke, over all windows of a rate."""

    ticks: int  # that were due, as far as it counts them
    late: int | None  # woken later than half a period; None where its histogram does not reach so far
    skipped: int | None  # not woken for at all, since the one before was late; None where it does not count them
    us: dict[str, float]  # p50, p99, p999, max
    record: Any  # rtctl.loop.histogram.HISTOGRAM


class Rate(NamedTuple):
    """What was measured at one rate, in Hz."""

    hz: float
    ours: Lateness
    cyclictest: Lateness | None

    @property
    def late(self) -> int:
        """Ticks of ours that came later than half a period, or not at all."""
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
    lacks: list[str]  # what the machine refused our loop
    without: str | None  # why there is no cyclictest beside it


def measure(
    rates: Sequence[float],
    seconds: int,
    cpu: int,
    priority: int,
    fifo: bool,
    lock: bool,
    say: Callable[[float, str], None],
) -> Measured:
    """Measure each rate for about `seconds` with each of the two; `say` gets the share that is done and a word.

    Without the right to lock memory cyclictest is not asked to; without SCHED_FIFO it does not run at all.
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
    """A rate as people say it: 10 kHz, 500 Hz."""
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
    """Where the buckets of `rtctl.loop.histogram` begin, in ns; each but the last ends where the next begins."""
    index = np.arange(histogram.BUCKETS)
    octave = np.maximum(index // histogram.SUB - 1, 0)
    return np.where(index < histogram.SUB, index, (index - histogram.SUB * octave) << octave)


def _last(error: Exception) -> str:
    said = (getattr(error, "stderr", None) or str(error)).strip().splitlines()
    return said[-1] if said else repr(error)
