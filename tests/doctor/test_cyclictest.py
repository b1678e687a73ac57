import json
import shutil
import subprocess

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.doctor import cyclictest, rights


def report(histogram: dict[int, int], cycles: int | None = None, longest: int = 0) -> dict:
    wakeups = sum(histogram.values()) if cycles is None else cycles
    thread = {
        "histogram": {str(k): v for k, v in histogram.items()},
        "cycles": wakeups,
        "max": longest or max(histogram),
    }
    return {"thread": {"0": thread}}


def test_cyclictest_wakeups_are_read_in_order():
    w = cyclictest.read(report({20_000: 1, 9_000: 3}))
    assert (w.ns.tolist(), w.hits.tolist(), w.wakeups, w.max_ns) == ([9_000, 20_000], [3, 1], 4, 20_000)


def test_wakeups_beyond_the_last_bucket_count():
    w = cyclictest.read(report({9_000: 8}, cycles=10, longest=5_000_000))
    assert (w.wakeups, w.later_than(9_000), w.later_than(1_000_000)) == (10, 2, 2)
    assert w.later_than(2_000_000) is None
    assert w.later_than(5_000_000) == 0
    assert w.percentiles()["p99"] == pytest.approx(1000.0, abs=0.01)
    assert w.percentiles()["max"] == 5000.0


@pytest.mark.parametrize("broken", [{}, {"thread": {}}, report({1: 1}) | {"thread": {"0": {"histogram": {}}}}])
def test_cyclictest_report_of_another_format_is_refused(broken):
    with pytest.raises(KeyError):
        cyclictest.read(broken)


def test_cyclictest_report_without_wakeups_is_refused():
    with pytest.raises(ValueError, match="no wake-up"):
        cyclictest.read({"thread": {"0": {"histogram": {}, "cycles": 0, "max": 0}}})


@settings(deadline=None)
@given(st.lists(st.integers(0, cyclictest.LONGEST_NS - 1), min_size=1, max_size=60), st.integers(0, 10**6))
def test_percentiles_agree_with_the_sorted_values(values, limit):
    ns, hits = np.unique(values, return_counts=True)
    w = cyclictest.Window(ns, hits, max(values))
    assert w.later_than(limit) == sum(v > limit for v in values)
    for name, share in cyclictest.SHARES.items():
        nearest = sorted(values)[int(np.ceil(share * len(values))) - 1]
        assert nearest <= 1000 * w.percentiles()[name] + 1e-6 <= nearest + 1.001


@settings(deadline=None)
@given(st.lists(st.dictionaries(st.integers(0, 50), st.integers(1, 9), min_size=1), min_size=1, max_size=5))
def test_joined_windows_are_the_sum_of_their_counts(windows):
    w = cyclictest.together([cyclictest.read(report(h)) for h in windows])
    for ns in range(51):
        assert w.hits[w.ns == ns].sum() == sum(h.get(ns, 0) for h in windows)
    assert w.max_ns == max(max(h) for h in windows)


def test_missing_cyclictest_is_reported(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "rt-tests" in (cyclictest.missing() or "")


@pytest.mark.parametrize("lock", [True, False])
def test_cyclictest_command_line(monkeypatch, tmp_path, lock):
    called = []

    def run(command, **_):
        called.extend(command)
        (tmp_path / "cyclictest.json").write_text(json.dumps(report({9_000: 3})))

    monkeypatch.setattr(subprocess, "run", run)
    assert cyclictest.run(10_000.0, 2, 3, 80, tmp_path, lock).wakeups == 3
    line = " ".join(called)
    assert "-p 80 -i 100 -a 3 -t 1" in line and "-N -q -D 2" in line
    assert ("-m" in called) == lock


@pytest.mark.realtime
def test_cyclictest_of_this_machine(tmp_path):
    if cyclictest.missing():
        pytest.skip(str(cyclictest.missing()))
    if not rights.may_fifo(80):
        pytest.skip("this account may not use SCHED_FIFO")
    w = cyclictest.run(500.0, 1, 0, 80, tmp_path, lock=False)
    assert w.wakeups > 0 and w.max_ns >= w.ns[0]
