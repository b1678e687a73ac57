import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.loop import histogram


def counted(values: list[int]) -> np.void:
    h = np.zeros(1, histogram.HISTOGRAM)[0]
    for value in values:
        histogram.add(h, value)
    return h


@settings(deadline=None)
@given(st.lists(st.integers(0, 2**36), min_size=1, max_size=300))
@example([0])
@example([31, 32, 33, 63, 64, 65])
@example([2**36])
def test_histogram_percentiles_agree_with_the_values(values: list[int]) -> None:
    found = histogram.percentiles(counted(values))
    for name, share in (("p50", 50), ("p99", 99), ("p999", 99.9)):
        true = np.percentile(values, share, method="inverted_cdf") / 1000
        assert found[name] == pytest.approx(true, rel=0.032, abs=1e-3), name
    assert found["max"] == pytest.approx(max(values) / 1000, abs=1e-3)


@settings(deadline=None)
@given(st.integers(0, 2**37 - 1))
def test_bucket_width_is_at_most_a_32nd_of_its_values(value: int) -> None:
    index = histogram._index(value)
    assert 0 <= index < histogram.BUCKETS
    assert abs(histogram._middle(index) - value) <= max(value / 64, 0)


def test_buckets_have_no_gaps() -> None:
    values = np.unique(np.concatenate([np.arange(5000), *(2**k + np.arange(-2, 3) for k in range(13, 37))]))
    indices = np.array([histogram._index(int(v)) for v in values])
    assert (np.diff(indices) >= 0).all()
    assert (np.diff(indices[:5000]) <= 1).all()
    assert [histogram._index(v) for v in (31, 32, 63, 64, 65, 66)] == [31, 32, 63, 64, 64, 65]


def test_times_out_of_range_are_counted_in_the_edge_buckets() -> None:
    h = counted([-5, 2**60])
    assert h["count"] == 2 and h["bucket"][0] == 1 and h["bucket"][-1] == 1 and h["max"] == 2**60


def test_empty_histogram_is_all_zeros() -> None:
    assert set(histogram.percentiles(counted([])).values()) == {0.0}
