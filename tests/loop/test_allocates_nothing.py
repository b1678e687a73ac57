"""The tick allocates no memory: allocations of a call do not depend on its number of ticks."""

import gc
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import njit
from numba.core.runtime import _nrt_python  # type: ignore[attr-defined]

PAGE = os.sysconf("SC_PAGE_SIZE")


@pytest.fixture
def counted() -> Iterator[Callable[[], tuple[int, int]]]:
    """Allocations and releases of compiled code so far."""
    _nrt_python.memsys_enable_stats()
    yield lambda: (_nrt_python.memsys_get_stats_alloc(), _nrt_python.memsys_get_stats_free())
    _nrt_python.memsys_disable_stats()


def resident() -> int:
    """Bytes of this process in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def during(counted: Callable[[], tuple[int, int]], call: Callable[[], Any]) -> tuple[int, int]:
    before = counted()
    call()
    after = counted()
    return after[0] - before[0], after[1] - before[1]


def test_a_million_ticks_allocate_no_memory(
    config: Callable[..., Any], bench: Callable[..., Any], counted: Callable[[], Any]
) -> None:
    steps = {"steps": [{"at": 0.2, "to": 1.0}, {"at": 1.2, "to": 0.0}], "repeat": 2.0}
    made = bench(config(set={"reference": steps, "safety.current_time": 0.0}), rows=1000)
    made.ask("arm", "play").run(2.0)
    gc.collect()
    one = during(counted, lambda: made.loop.stretch(made.ticks, 1))
    memory = resident()
    million = during(counted, lambda: made.loop.stretch(made.ticks + 1, 1_000_000))
    assert million == one
    assert resident() - memory < 64 * PAGE  # one byte per tick would be four times as much
    assert made.status["state"] == 2  # running until the end


@njit
def allocate(times):
    total = 0.0
    for k in range(times):
        total += np.zeros(k + 3)[k]
    return total


def test_allocation_counter_detects_an_allocation(counted: Callable[[], Any]) -> None:
    allocate(1)
    few, many = during(counted, lambda: allocate(1)), during(counted, lambda: allocate(100))
    assert many[0] - few[0] == many[1] - few[1] == 99
