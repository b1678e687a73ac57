import os

import numpy as np
import pytest

from rtctl.doctor import wakeup
from rtctl.doctor.wakeup import Sleeper

CPU = max(os.sched_getaffinity(0))


@pytest.mark.realtime
def test_every_due_tick_is_counted_or_skipped():
    with Sleeper(CPU, 80) as sleeper:
        assert all(isinstance(lack, str) for lack in sleeper.lacks)
        for period in (10_000_000, 5_000_000):
            w = sleeper.window(period, 1)
            assert sum(w["count"]) + w["skipped"] >= 1_000_000_000 // period
            assert 0 <= w["late"] <= sum(w["count"]) and w["max"] > 0
            assert (w["skipped"] == 0) == (w["max"] < period)
    assert sleeper._process.poll() is not None


def test_scheduling_of_this_process_is_unchanged():
    before = os.sched_getscheduler(0), os.sched_getaffinity(0)
    with Sleeper(CPU, 80):
        assert (os.sched_getscheduler(0), os.sched_getaffinity(0)) == before


def test_ended_measurement_process_reports_its_error():
    with pytest.raises(RuntimeError, match=r"the empty loop ended: .*sideways"), Sleeper("sideways", 80):  # type: ignore[arg-type]
        pass


def test_lateness_is_measured_by_the_clock(monkeypatch):
    """The uncompiled loop on a stubbed clock: lateness 10, 60 and 330 ns."""
    times = iter([0, 110, 260, 630, 700])  # start, then the clock after each sleep
    slept: list[int] = []
    monkeypatch.setattr(wakeup.clock, "now", lambda: next(times))
    monkeypatch.setattr(wakeup.clock, "sleep_until", slept.append)
    monkeypatch.setattr(wakeup, "borrowed", lambda array: array)

    window = np.zeros(1, wakeup.WINDOW).view(np.recarray)
    counted: list[int] = []
    monkeypatch.setattr(wakeup.histogram, "add", lambda h, ns: counted.append(ns))
    wakeup.empty_loop.py_func(window, 100, 7)
    assert slept == [100, 200, 300, 700]
    assert counted == [10, 60, 330, 0]
    assert (int(window[0].late), int(window[0].skipped)) == (2, 3)
