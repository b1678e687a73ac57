"""Memory of the process, sampled: it may grow while all is warming up, and not afterwards."""

import resource
from pathlib import Path

from rtctl.soak.checker import Checker

MOST_MB = 64.0  # beyond the most while it warmed up
WARM, LEAST = 0.1, 40  # share of the soak, and events, of which each kind loads something the first time
PAGE_MB = resource.getpagesize() / 2**20


def resident_mb() -> float:
    """Resident set of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_MB


class Memory:
    """Sampled at event boundaries. `share` is how far the soak is, as this process has seen it, 0 to 1."""

    def __init__(self) -> None:
        self.base = self.most = resident_mb()
        self._told = False
        self._samples = 0

    def sample(self, share: float, checker: Checker, tick: int) -> None:
        """A violation, once, where the memory has grown beyond what a flat one would."""
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
