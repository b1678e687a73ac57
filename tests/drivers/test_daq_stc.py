import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.drivers import daq_stc

HALF = 1 << 23
steps = st.lists(
    st.one_of(st.integers(1 - HALF, HALF - 1), st.sampled_from((HALF - 1, 1 - HALF, 0, 1, -1))), max_size=60
)


def new():
    return np.zeros(1, daq_stc.COUNTER_STATE)[0], np.zeros(1, daq_stc.READER_STATE)[0]


def count(s, step):
    return daq_stc.counter_step(s, abs(step), 1 if step >= 0 else 0)


@settings(deadline=None)
@given(steps)
def test_position_is_the_sum_of_all_steps_across_wraps(path):
    counter, reader = new()
    total = 0
    for step in path:
        codes = count(counter, step)
        assert 0 <= codes < 1 << 24
        total += step
        assert daq_stc.counter_position(reader, codes) == total


def test_counter_wraps_at_both_ends():
    counter, _ = new()
    assert count(counter, 0) == 8388608
    assert count(counter, HALF - 1) == (1 << 24) - 1
    assert count(counter, 1) == 0
    assert count(counter, -1) == (1 << 24) - 1


def test_first_reading_counts_from_the_initial_count():
    _, reader = new()
    assert daq_stc.counter_position(reader, 8388608 + 5) == 5
