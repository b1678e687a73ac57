"""Overrun of the loop: late ticks are counted and skipped, never made up in a burst."""

import signal
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

SPIN = 0
TICKS = 5000


@pytest.fixture
def loop(config: Callable[..., Any], bench: Callable[..., Any]) -> Callable[..., Any]:
    """Run the real loop with a period in ns, idle and without a plant; returns rows and status."""

    def run(period: int, ticks: int = TICKS, late: int = 0, spin: int = SPIN) -> tuple[np.ndarray, np.void]:
        made = bench(config(mode="real"))
        entry, arguments = made.loop.entry()
        *head, _period, _late, ahead, _spin, _most = arguments
        entry(*head, period, late, ahead, spin, ticks)
        return made.reader.take(), made.status

    return run


def grid(rows: np.ndarray, period: int) -> np.ndarray:
    """Index of the period in which each tick was due (n,); asserts due times on the grid of the period."""
    due = (rows["t"] - rows["lateness"]) * 1e9 / period
    assert np.allclose(due, np.round(due), atol=0.02)
    return np.round(due).astype(int)


@pytest.mark.parametrize("period", [1_000, 20_000])
def test_ticks_and_missed_ticks_add_up_to_the_elapsed_periods(loop: Callable[..., Any], period: int) -> None:
    rows, status = loop(period)
    due = grid(rows, period)
    skipped = np.floor(np.round(rows["lateness"] * 1e9) / period).astype(int)
    assert len(rows) == TICKS == status["tick"] == status["lateness"]["count"]
    assert due[0] == 0
    assert (np.diff(due) == 1 + skipped[:-1]).all()  # no burst: the next tick is at the next full period
    assert status["missed"] == skipped.sum()
    assert due[-1] + 1 + skipped[-1] == TICKS + status["missed"]


def test_too_short_period_counts_missed_ticks_and_overruns(loop: Callable[..., Any]) -> None:
    rows, status = loop(1_000)
    assert status["missed"] > TICKS and status["overruns"] > 0
    assert status["late"] == np.count_nonzero(rows["lateness"] > 0)
    assert np.diff(rows["t"]).min() > 0


def test_no_tick_is_early(loop: Callable[..., Any]) -> None:
    rows, _ = loop(100_000, ticks=1000, spin=30_000)
    assert (rows["lateness"] >= 0).all()
    assert rows["period"][0] >= 0 and np.allclose(np.diff(rows["t"]), rows["period"][1:], atol=2e-9)


def test_signal_during_a_sleep_causes_no_early_tick(loop: Callable[..., Any]) -> None:
    before = signal.signal(signal.SIGALRM, lambda *_: None)
    signal.setitimer(signal.ITIMER_REAL, 1e-3, 0.3e-3)
    try:
        rows, _ = loop(1_000_000, ticks=200)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert (rows["lateness"] >= 0).all()
    grid(rows, 1_000_000)


def test_late_ticks_are_counted_beyond_the_late_threshold_only(loop: Callable[..., Any]) -> None:
    rows, status = loop(200_000, ticks=500, late=10**12)
    assert status["late"] == 0
    rows, status = loop(200_000, ticks=500, late=60_000)
    assert status["late"] == np.count_nonzero(np.round(rows["lateness"] * 1e9) > 60_000)


def test_loop_without_a_plant_stays_idle_and_its_link_age_grows(
    loop: Callable[..., Any], bench: Callable[..., Any]
) -> None:
    rows, status = loop(100_000, ticks=10)
    assert status["ended"] == 1 and status["link_frames"] == 0
    assert (np.diff(rows["link_age"]) >= 1).all()  # periods of the clock, with the missed ones
    assert rows["link_age"][0] >= 1 and not rows["state"].any()
