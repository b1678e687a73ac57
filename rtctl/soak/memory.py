"""Samples of the process's memory, which may grow during the warm-up only."""

import resource
from pathlib import Path

from rtctl.soak.checker import Checker

MOST_MB = 64.0  # MB of growth allowed beyond the largest value in the warm-up
WARM, LEAST = 0.1, 40  # least warm-up: fraction of the soak, and events (each kind allocates at its first use)
PAGE_MB = resource.getpagesize() / 2**20


def resident_mb() -> float:
    """Resident set of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_MB


class Memory:
    """Memory samples between events; `base` is the largest value in the warm-up, `most` of all, MB."""

    def __init__(self) -> None:
        self.base = self.most = resident_mb()
        self._told = False
        self._samples = 0

    def sample(self, share: float, checker: Checker, tick: int) -> None:
        """Take a sample; note a violation once if the memory has grown too far after the warm-up.

        `share` is the part of the soak done by this process, 0 to 1.
        """
        now = resident_mb()
        self.most = max(self.most, now)
        self._samples += 1
        if share <= WARM or self._samples <= LEAST:
            self.base = max(self.base, now)
            return
        checker.checked("memory")
        if now > self.base + MOST_MB and not self._told:
            self._told = True
            checker.note("memory", tick, now, self.base + MOST_MB)
