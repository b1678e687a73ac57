import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.doctor import cyclictest, measure
from rtctl.doctor.cyclictest import Window
from rtctl.loop import histogram

OURS = {"late": 2, "skipped": 3, "max": 400_000, "bucket": [40, 90], "count": [90, 5]}


@pytest.fixture
def windows(monkeypatch) -> list[str]:
    """Measured windows in order; the measurements are stubbed."""
    order: list[str] = []

    class Sleeper:
        lacks = ("no luck",)

        def __init__(self, cpu: int, priority: int):
            assert (cpu, priority) == (1, 80)

        def __enter__(self) -> "Sleeper":
            return self

        def __exit__(self, *_: Any) -> None: ...

        def window(self, period: int, seconds: int) -> dict[str, Any]:
            order.append(f"rtctl {period} {seconds}")
            return OURS

    def run(rate, seconds, cpu, priority, folder, lock):
        assert folder.is_dir() and lock and (cpu, priority) == (1, 80)
        order.append(f"cyclictest {rate:g} {seconds}")
        return Window(np.array([9_000, 60_000]), np.array([99, 1]), 60_000)

    monkeypatch.setattr(measure, "Sleeper", Sleeper)
    monkeypatch.setattr(cyclictest, "run", run)
    monkeypatch.setattr(cyclictest, "missing", lambda: None)
    return order


def run(seconds: int = 2, fifo: bool = True, say: Callable[[float, str], None] = lambda *_: None) -> measure.Measured:
    return measure.measure([500.0, 10_000.0], seconds, 1, 80, fifo, True, say)


def test_windows_alternate_and_swap_order_each_round(windows):
    said: list[tuple[float, str]] = []
    m = run(2, say=lambda share, word: said.append((share, word)))
    assert windows == [
        "rtctl 2000000 1", "cyclictest 500 1", "rtctl 100000 1", "cyclictest 10000 1",
        "cyclictest 500 1", "rtctl 2000000 1", "cyclictest 10000 1", "rtctl 100000 1",
    ]  # fmt: skip
    assert (m.rounds, m.window_s, m.without, list(m.lacks)) == (2, 1, None, ["no luck"])
    shares = [share for share, _ in said]
    assert shares == sorted(shares) and shares[-1] == 1.0


@pytest.mark.parametrize(("seconds", "rounds", "window"), [(1, 1, 1), (5, 5, 1), (60, 5, 12), (7, 7, 1), (8, 4, 2)])
def test_measurement_has_the_requested_length(windows, seconds, rounds, window):
    m = run(seconds)
    assert (m.rounds, m.window_s) == (rounds, window)
    assert len(windows) == 4 * rounds


def test_all_windows_are_summed(windows):
    rate = run(2).rates[1]
    assert (rate.ours.ticks, rate.ours.late, rate.ours.skipped) == (2 * 98, 4, 6)
    assert (rate.late, rate.held, rate.ours.us["max"]) == (10, False, 400.0)
    assert rate.ours.record["bucket"][40] == 180
    assert rate.cyclictest is not None
    assert (rate.cyclictest.ticks, rate.cyclictest.late, rate.cyclictest.us["max"]) == (200, 2, 60.0)
    assert rate.cyclictest.record["bucket"].sum() == 200


def test_late_threshold_is_half_the_period_of_each_rate(windows):
    slow, fast = run(1).rates
    assert slow.cyclictest is not None and fast.cyclictest is not None
    assert (slow.cyclictest.late, fast.cyclictest.late) == (0, 1)


@pytest.mark.parametrize(("late", "held"), [(0, True), (10, True), (11, False)])
def test_rate_is_held_with_a_thousandth_of_late_ticks(lateness, late, held):
    assert measure.Rate(1000.0, lateness({9_000: 10_000}, late=late), None).held is held


def test_skipped_ticks_are_late(lateness):
    ours = lateness({9_000: 9_980}, late=1, skipped=20)
    assert (measure.Rate(1000.0, ours, None).late, measure.Rate(1000.0, ours, None).held) == (21, False)


def test_measurement_without_cyclictest(windows, monkeypatch):
    monkeypatch.setattr(cyclictest, "missing", lambda: "cyclictest is not installed here")
    m = run()
    assert m.without == "cyclictest is not installed here"
    assert [rate.cyclictest for rate in m.rates] == [None, None]
    assert {who.split()[0] for who in windows} == {"rtctl"}


def test_cyclictest_is_skipped_without_fifo(windows):
    m = run(fifo=False)
    assert "SCHED_FIFO" in (m.without or "")
    assert {who.split()[0] for who in windows} == {"rtctl"}


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (subprocess.CalledProcessError(1, "cyclictest", stderr="WARN\nUnable to do it.\n"), "Unable to do it."),
        (FileNotFoundError("cyclictest.json"), "cyclictest.json"),
        (ValueError("it counted no wake-up"), "no wake-up"),
    ],
)
def test_cyclictest_failure_during_the_measurement_is_reported(windows, monkeypatch, error, words):
    def fail(*_):
        raise error

    monkeypatch.setattr(cyclictest, "run", fail)
    m = run()
    assert words in (m.without or "")
    assert [rate.cyclictest for rate in m.rates] == [None, None]
    assert len(windows) == 4


@settings(deadline=None, max_examples=60)
@given(st.lists(st.integers(0, 2**37 - 1), min_size=1, max_size=50))
def test_bucket_edges_are_those_of_the_loop_histogram(values):
    h = np.zeros(1, histogram.HISTOGRAM)[0]
    for value in values:
        h["bucket"][histogram._index.py_func(value)] += 1
    mine = np.searchsorted(measure.edges(), values, "right") - 1
    assert np.array_equal(np.bincount(mine, minlength=histogram.BUCKETS), h["bucket"])


def test_rate_labels():
    assert [measure.words(hz) for hz in (500.0, 1000.0, 10_000.0, 12_500.0)] == [
        "500 Hz",
        "1 kHz",
        "10 kHz",
        "12.5 kHz",
    ]
