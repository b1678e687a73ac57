import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rtctl.trace.losses import MOST_GAPS, Losses


@given(st.sets(st.integers(0, 200)), st.integers(1, 5))
def test_gaps_are_exactly_the_lost_ticks(ticks, parts):
    losses = Losses()
    for part in np.array_split(np.array(sorted(ticks), dtype=int), parts):
        losses.add_ticks(part)
    listed = [tick for first, count in losses.gaps for tick in range(first, first + count)]
    assert listed == sorted(ticks) and losses.rows == len(ticks)
    assert all(a + n < b for (a, n), (b, _) in zip(losses.gaps, losses.gaps[1:], strict=False))


def test_gaps_reported_out_of_order_are_joined():
    losses = Losses()
    losses.add(20, 5)
    losses.add(10, 10)
    losses.add(3, 0)
    assert losses.as_dict() == {"rows": 15, "gaps": [[10, 15]]}


def test_list_of_gaps_is_bounded_but_the_count_is_exact():
    losses = Losses()
    for k in range(MOST_GAPS + 3):
        losses.add(10 * k, 2)
    told = losses.as_dict()
    assert (told["rows"], len(told["gaps"]), told["unlisted_gaps"]) == (2 * MOST_GAPS + 6, MOST_GAPS, 3)
