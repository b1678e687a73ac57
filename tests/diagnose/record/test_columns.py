import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.diagnose.record.columns import even_clock, laid, running, through_amplifier, unwrap


@pytest.mark.parametrize(
    "state, rows",
    [([0, 1, 2, 2, 3], (2, 4)), ([2, 2], (0, 2)), ([2, 0, 2, 2, 0], (2, 4)), ([0, 1, 1], (0, 0)), ([], (0, 0))],
)
def test_running_rows_are_selected_by_state(state, rows):
    found = running(np.array(state))
    assert (found.start, found.stop) == rows


def test_amplifier_characteristic_of_the_thesis():
    u = np.array([-2.8, -0.0, 0.0, 0.5, 0.8, 2.8])
    assert 0.1 * through_amplifier(u) == pytest.approx([-0.242, -0.042, 0.042, 0.042, 0.042, 0.242])  # A, (12.3)


@settings(deadline=None, max_examples=60)
@given(st.sampled_from([16, 24, 32]), st.lists(st.integers(-900, 900), min_size=3, max_size=300), st.integers(0, 2**31))
def test_wrapping_counter_is_unwrapped(bits, steps, start):
    true = start + np.concatenate(([0], np.cumsum(steps)))
    wrapped = (true % 2**bits).astype(float)
    counts, found, wraps = unwrap(wrapped)
    assert np.array_equal(counts - counts[0], (true - true[0]).astype(float))
    assert (found is None) == (wraps == 0)
    if found is not None:
        assert found == bits


def test_wide_range_and_single_jump_are_not_a_wrap():
    assert unwrap(np.array([0.0, 30000.0, 70000.0, 20.0]))[1] is None
    assert unwrap(np.array([0.0, 1.0, 2.0, 40000.0, 40001.0]))[1] is None


def test_uneven_rows_are_resampled_to_an_even_clock():
    t = np.array([0.0, 0.9, 2.1, 3.0]) * 1e-3
    even = even_clock(t, 1e-3)
    assert even == pytest.approx([0.0, 1e-3, 2e-3, 3e-3])
    assert laid(even, t, 2000.0 * t) == pytest.approx([0.0, 2.0, 4.0, 6.0])
    assert laid(even, t, np.array([0.0, 1.0, 2.0, 3.0]), whole=True).tolist() == [0.0, 1.0, 2.0, 3.0]
