"""cyclictest of rt-tests: its call, and the reader of its histogram.

Source: cyclictest(8), rt-tests 2.0 and newer (--json).
"""

import json
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

SHARES = {"p50": 0.5, "p99": 0.99, "p999": 0.999}
LONGEST_NS = 1_000_000  # ns, longest lateness in cyclictest's buckets; later wake-ups are counted here


class Window(NamedTuple):
    """Histogram of cyclictest: wake-ups by lateness, in the buckets of 1 ns that are not empty."""

    ns: np.ndarray  # int, in order; LONGEST_NS stands for all later wake-ups
    hits: np.ndarray  # int, of the same length
    max_ns: int

    @property
    def wakeups(self) -> int:
        return int(self.hits.sum())

    def percentiles(self) -> dict[str, float]:
        """p50, p99, p999 and max in us, linear within the bucket that holds them."""
        cumulative = np.cumsum(self.hits)
        out = {}
        for name, share in SHARES.items():
            wanted = share * cumulative[-1]
            i = int(np.searchsorted(cumulative, wanted))
            before = cumulative[i] - self.hits[i]
            out[name] = round(float(self.ns[i] + (wanted - before) / self.hits[i]) / 1000, 3)
        return {**out, "max": round(self.max_ns / 1000, 3)}

    def later_than(self, ns: int) -> int | None:
        """Number of wake-ups later than `ns`; None where it is beyond the buckets and not 0."""
        if ns > LONGEST_NS:
            return None if self.max_ns > ns else 0
        return int(self.hits[self.ns > min(ns, LONGEST_NS - 1)].sum())


def missing() -> str | None:
    """Sentence on why cyclictest cannot be run; None where it can."""
    return None if shutil.which("cyclictest") else "cyclictest is not installed here; it comes with rt-tests"


def run(rate: float, seconds: float, cpu: int, priority: int, folder: Path, lock: bool = True) -> Window:
    """One window of cyclictest on `cpu`, of at least one whole second; `lock` locks its memory.

    Raises subprocess.CalledProcessError with its `stderr` where cyclictest refuses.
    """
    report = folder / "cyclictest.json"
    command = (
        "cyclictest", *(("-m",) if lock else ()), "-p", str(priority),
        "-i", str(round(1e6 / rate)), "-a", str(cpu), "-t", "1",
        "-h", str(LONGEST_NS), "-N", "-q", "-D", str(max(1, round(seconds))), f"--json={report}",
    )  # fmt: skip
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    return read(json.loads(report.read_text()))


def read(report: Mapping) -> Window:
    """Window of a report's first thread. Raises ValueError where it never woke, KeyError for no report."""
    thread = report["thread"]["0"]
    return counted(thread["histogram"], int(thread["cycles"]), int(thread["max"]))


def counted(histogram: Mapping[str, int], cycles: int, max_ns: int = LONGEST_NS) -> Window:
    """Window from wake-ups by ns; of `cycles` wake-ups those in no bucket count as later than all buckets.

    Raises ValueError where there was no wake-up.
    """
    ns = np.array(sorted(map(int, histogram)), np.int64)
    hits = np.array([histogram[str(value)] for value in ns], np.int64)
    beyond = cycles - int(hits.sum())
    if beyond > 0:
        ns, hits = np.append(ns, LONGEST_NS), np.append(hits, beyond)
    if not len(ns):
        raise ValueError("it counted no wake-up")
    return Window(ns, hits, max_ns)


def together(windows: Sequence[Window]) -> Window:
    """Sum of several windows."""
    ns, where = np.unique(np.concatenate([w.ns for w in windows]), return_inverse=True)
    hits = np.zeros(len(ns), np.int64)
    np.add.at(hits, where, np.concatenate([w.hits for w in windows]))
    return Window(ns, hits, max(w.max_ns for w in windows))
