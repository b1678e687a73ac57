"""Thinned rows keep all extremes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.foxglove.envelope import Envelope

ROW = [("tick", "i8"), ("t", "f8"), ("u", "f8")]


def rows_of(values):
    rows = np.zeros(len(values), ROW)
    rows["tick"] = np.arange(len(values))
    rows["t"] = rows["tick"] * 1e-4
    rows["u"] = values
    return rows


@settings(deadline=None)
@given(st.lists(st.floats(-1e3, 1e3), max_size=60), st.integers(1, 9), st.lists(st.integers(0, 60), max_size=5))
def test_extremes_are_those_of_all_rows_for_any_batches(values, every, cuts):
    rows = rows_of(values)
    envelope = Envelope(every)
    parts = [envelope.feed(part) for part in np.split(rows, sorted(min(cut, len(rows)) for cut in cuts))]
    newest, low, high = (np.concatenate(kind) for kind in zip(*parts, strict=True))
    whole = len(rows) // every * every
    assert np.array_equal(newest, rows[every - 1 : whole : every])
    if every == 1:
        assert not len(low) and not len(high)
        return
    table = rows["u"][:whole].reshape(-1, every)
    assert np.array_equal(low["u"], table.min(axis=1)) and np.array_equal(high["u"], table.max(axis=1))
    assert np.array_equal(low["t"], newest["t"]) and np.array_equal(high["tick"], newest["tick"])


def test_extreme_is_nan_only_if_all_values_are_nan():
    thinned = Envelope(2).feed(rows_of([np.nan, 1.0, np.nan, np.nan]))
    assert thinned.low["u"][0] == thinned.high["u"][0] == 1.0
    assert np.isnan(thinned.low["u"][1])


def test_envelope_of_zero_rows_is_refused():
    with pytest.raises(ValueError, match="every is 0"):
        Envelope(0)
