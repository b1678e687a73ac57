import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.trace.capture import Capture
from rtctl.trace.trigger import Trigger

ROW = np.dtype([("tick", "i8"), ("error", "f8")])
RATE = 100.0


def run(capture: Capture, ticks: np.ndarray, fires: int | None, cuts: list[int]) -> np.ndarray:
    """Feed rows of `ticks`, with an error from tick `fires` on; returns the captured rows."""
    rows = np.zeros(len(ticks), ROW)
    rows["tick"] = ticks
    rows["error"] = ticks >= (math.inf if fires is None else fires)
    written = []
    for batch in np.split(rows, sorted(min(cut, len(rows)) for cut in cuts)):
        rows_out, done = capture.feed(batch)
        assert done == capture.done
        written.append(rows_out)
    return np.concatenate(written)["tick"]


def on_error() -> Trigger:
    return Trigger("error > 0.5", ROW.names)


@settings(deadline=None)
@given(
    lost=st.sets(st.integers(0, 299), max_size=150),
    cuts=st.lists(st.integers(0, 300), max_size=12),
    fires=st.integers(1, 299),
    pre=st.integers(0, 120),
    length=st.integers(1, 200),
)
def test_capture_contains_exactly_the_rows_around_the_trigger(lost, cuts, fires, pre, length):
    ticks = np.array(sorted(set(range(300)) - lost))
    later = ticks[ticks >= fires]
    capture = Capture(length / RATE, pre / RATE, on_error(), RATE)
    written = run(capture, ticks, fires, cuts)
    if not len(later) or later[0] == ticks[0]:
        assert len(written) == 0 and capture.trigger_tick is None
        return
    at = later[0]
    assert capture.trigger_tick == at
    assert written.tolist() == [tick for tick in ticks if at - pre <= tick < at + length]
    assert capture.done == bool(ticks[-1] >= at + length - 1)


@given(st.lists(st.integers(0, 100), max_size=5))
def test_capture_without_a_trigger_starts_at_the_first_row(cuts):
    capture = Capture(0.3, 0.5, None, RATE)
    assert run(capture, np.arange(1000, 1100), None, cuts).tolist() == list(range(1000, 1030))
    assert capture.done and capture.trigger_tick == 1000


def test_capture_of_infinite_length_records_to_the_end():
    capture = Capture(math.inf, 0.0, None, RATE)
    assert len(run(capture, np.arange(5000), None, [100, 900])) == 5000
    assert not capture.done


def test_pretrigger_buffer_is_bounded():
    capture = Capture(1.0, 0.5, on_error(), RATE)
    for first in range(0, 10_000, 20):
        rows = np.zeros(20, ROW)
        rows["tick"] = np.arange(first, first + 20)
        capture.feed(rows)
        assert sum(map(len, capture._before)) <= 50 + 20


def test_capture_returns_nothing_after_its_end():
    capture = Capture(0.1, 0.0, None, RATE)
    run(capture, np.arange(20), None, [])
    rows, done = capture.feed(np.zeros(5, ROW))
    assert (len(rows), done) == (0, True)


@pytest.mark.parametrize("times", [(0, 0, 100), (1, -1, 100), (1, math.inf, 100), (1, 0, 0), (math.nan, 0, 1)])
def test_invalid_capture_times_are_refused(times):
    with pytest.raises(ValueError, match="a capture needs"):
        Capture(times[0], times[1], None, times[2])


def test_history_fills_the_pretrigger_but_never_triggers():
    rows = np.zeros(100, [("tick", "i8"), ("t", "f8"), ("x", "f8")])
    rows["tick"] = np.arange(100)
    rows["x"][20:30] = 1.0  # an event before the request
    rows["x"][70:] = 1.0
    capture = Capture(0.1, 0.1, Trigger("x > 0.5", ["tick", "t", "x"]), 100.0)
    capture.prime(rows[:50])
    taken, done = capture.feed(rows[50:])
    assert done and capture.trigger_tick == 70
    assert taken["tick"].tolist() == list(range(60, 80))


def test_history_precedes_a_capture_without_a_trigger():
    rows = np.zeros(100, [("tick", "i8"), ("t", "f8")])
    rows["tick"] = np.arange(100)
    capture = Capture(0.2, 0.1, None, 100.0)
    capture.prime(rows[:50])
    taken, done = capture.feed(rows[50:])
    assert done and taken["tick"].tolist() == list(range(40, 70))
