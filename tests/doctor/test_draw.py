import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.doctor import draw
from rtctl.doctor.measure import Lateness, edges
from rtctl.loop import histogram


def test_marks_are_above_their_columns(lateness):
    h = lateness({15_000: 9_000, 30_000: 990, 200_000: 10})
    axis = draw.axis([h], 80)
    head, *rest = draw.lines(h, axis)
    assert (axis.low, axis.high) == (4, 6)
    for mark, name in (("50", "p50"), ("99.9", "p999")):
        assert head.index(mark) - 8 == axis.column(1000 * h.us[name])
    assert len(rest) == draw.HEIGHT
    assert rest[0].startswith(" 10000 |") and rest[-1].startswith("     1 |")
    assert rest[-1][8 + axis.column(15_000)] == draw.EIGHTHS[8]


def test_overlapping_marks_are_on_separate_rows():
    assert draw.labels({3: "50", 4: "99", 12: "max"}) == ["    99", "   50       max"]


@settings(deadline=None, max_examples=80)
@given(st.dictionaries(st.integers(0, 2**36), st.integers(1, 10**6), min_size=1, max_size=20), st.integers(20, 200))
def test_histogram_is_complete_and_fits_the_width(wakeups, width):
    record = np.zeros(1, histogram.HISTOGRAM)[0]
    for ns, count in wakeups.items():
        record["bucket"][np.searchsorted(edges(), ns, "right") - 1] += count
    record["count"], record["max"] = sum(wakeups.values()), max(wakeups)
    h = Lateness(int(record["count"]), 0, 0, histogram.percentiles(record), record)
    axis = draw.axis([h], width)
    assert draw.per_column(h, axis).sum() == sum(wakeups.values())
    for row in (*draw.lines(h, axis)[-draw.HEIGHT :], *draw.foot(axis)):
        assert len(row) <= axis.columns + 8
    assert axis.columns + 8 < max(width, draw.LEAST + 9)


def test_histogram_in_ascii_characters(lateness):
    h = lateness({15_000: 9_000, 200_000: 1})
    text = "\n".join(draw.lines(h, draw.axis([h], 60), blocks=False))
    assert text.isascii() and "#" in text and "|" in text


def test_one_axis_covers_both_histograms(lateness):
    a, b = lateness({9_000: 1}), lateness({2_000_000: 1})
    axis = draw.axis([a, b], 80)
    assert (axis.low, axis.high) == (3, 7)
    rule, words = draw.foot(axis)
    for decade, text in enumerate(("1 us", "10 us", "100 us", "1 ms", "10 ms")):
        assert text in words
        if decade < 4:
            assert rule[words.index(text)] == "+"


@pytest.mark.parametrize(("ns", "text"), [(100, "100 ns"), (1e3, "1 us"), (1e6, "1 ms"), (1e9, "1 s")])
def test_time_unit_labels(ns, text):
    assert draw.unit(ns) == text
