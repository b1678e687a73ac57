"""Peak history keeps every maximum; sparklines show the peaks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.terminal.spark import STRETCH, WINDOW, Peaks, sparkline


def test_peak_of_one_tick_in_ten_thousand_is_kept():
    peaks = Peaks()
    t = np.arange(0, 20, 1e-3)
    values = np.where(t == t[12_345], -7.0, 0.1)
    for part in np.array_split(np.arange(len(t)), 77):
        peaks.feed(t[part], values[part])
    bars = peaks.bars(60)
    assert peaks.peak == 7.0
    assert np.isnan(bars[:20]).all()  # before the start
    assert list(np.flatnonzero(bars == 7.0)) == [20 + 24]
    assert sparkline(bars, peaks.peak)[44] == "█"


def test_peaks_older_than_the_window_are_dropped():
    peaks = Peaks()
    peaks.feed(np.array([1.0]), np.array([9.0]))
    peaks.feed(np.array([1.0 + WINDOW]), np.array([2.0]))
    assert peaks.peak == 2.0
    peaks.feed(np.array([500.0]), np.array([1.0]))  # a long pause
    assert peaks.peak == 1.0
    assert np.isfinite(peaks.bars(30)).sum() == 1


def test_restarted_clock_restarts_the_window():
    peaks = Peaks()
    peaks.feed(np.arange(0, 10, 0.1), np.full(100, 5.0))
    peaks.feed(np.array([0.05]), np.array([1.0]))
    assert peaks.peak == 1.0


def test_nan_is_ignored():
    peaks = Peaks()
    peaks.feed(np.array([0.0, 0.01]), np.array([np.nan, np.inf]))
    assert np.isnan(peaks.peak)
    assert sparkline(peaks.bars(5), peaks.peak) == " " * 5


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0, 100), min_size=1, max_size=200), st.integers(1, 400))
def test_highest_bar_is_the_peak_at_every_width(times, count):
    t = np.sort(np.array(times))
    values = np.cos(t)
    peaks = Peaks()
    peaks.feed(t, values)
    kept = t > np.floor(t[-1] / STRETCH + 1e-6) * STRETCH - WINDOW + STRETCH - 1e-6
    bars = peaks.bars(count)
    assert np.nanmax(bars) == peaks.peak == pytest.approx(np.abs(values[kept]).max())
    assert len(bars) <= count


@pytest.mark.parametrize(("ascii_only", "full"), [(False, "█"), (True, "@")])
def test_sparkline_characters(ascii_only, full):
    shown = sparkline(np.array([np.nan, 0.0, 0.5, 1.0]), 1.0, ascii_only)
    assert shown[0] == " " and shown[3] == full
    assert len(set(shown)) == 4
    assert shown.isascii() == ascii_only
    assert sparkline(np.zeros(2), 0.0, True) == ".."
