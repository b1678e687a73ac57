"""Fixtures: a machine emulated by files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rtctl.doctor.finding import Tree
from rtctl.doctor.measure import Lateness, edges
from rtctl.loop import histogram


@pytest.fixture
def tree(tmp_path: Path) -> Callable[..., Tree]:
    """`tree({"proc/swaps": "..."})`: a machine with these files only."""

    def make(files: dict[str, str] | None = None) -> Tree:
        for name, text in (files or {}).items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return Tree(tmp_path)

    return make


@pytest.fixture
def lateness() -> Callable[..., Lateness]:
    """`lateness({15_000: 90, 60_000: 10}, late=10)`: counts of wake-ups by lateness, ns."""

    def make(wakeups: dict[int, int], late: int | None = 0, skipped: int | None = 0) -> Lateness:
        record = np.zeros(1, histogram.HISTOGRAM)[0]
        for ns, count in wakeups.items():
            record["bucket"][np.searchsorted(edges(), ns, "right") - 1] += count
        record["count"], record["max"] = sum(wakeups.values()), max(wakeups)
        ticks = sum(wakeups.values()) + (skipped or 0)
        return Lateness(ticks, late, skipped, histogram.percentiles(record), record)

    return make
