"""Lines fitted to the terminal width."""

from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.terminal.fit import Part, columns, fit

PARTS = [Part(0, "first"), Part(2, "second"), Part(1, "third"), Part(3, "")]


def test_least_important_part_is_dropped_first():
    assert fit(PARTS, 40).plain == "first  second  third"
    assert fit(PARTS, 19).plain == "first  third"
    assert fit(PARTS, 11).plain == "first"
    assert fit(PARTS, 4).plain == "fir…"
    assert fit(PARTS, 4, "...").plain == "f..."


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), st.text(max_size=12)), max_size=6), st.integers(0, 40))
def test_fitted_line_never_exceeds_the_width(parts, width):
    assert fit([Part(*part) for part in parts], width).cell_len <= width


def test_columns_are_dropped_by_importance():
    widths = {"a": 5, "b": 5, "c": 5}
    assert columns(widths, ("b", "a", "c"), 12) == {"a", "b"}
    assert columns(widths, ("b", "a", "c"), 11) == {"b"}
    assert columns(widths, ("b", "a", "c"), 1) == {"b"}
