import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.idiom import state
from rtctl.scope.history import History

ROW = state(tick=int, u=float)


def table(first, count):
    rows = np.zeros(count, ROW)
    rows["tick"] = np.arange(first, first + count)
    rows["u"] = 0.5 * rows["tick"]
    return rows


@settings(deadline=None)
@given(st.lists(st.integers(0, 25), max_size=12), st.integers(0, 80), st.integers(0, 30))
def test_rows_are_found_by_number_for_any_batches(blocks, first, count):
    kept, sent = History(ROW, 16), 0
    for block in blocks:
        kept.append(table(sent, block))
        sent += block
    assert kept.head == sent
    taken = kept.take(("u", "tick"), first, first + count)
    expected = [n for n in range(first, first + count) if max(0, sent - 16) <= n < sent]
    assert taken.tolist() == [[0.5 * n for n in expected], expected]


def test_rows_lost_by_the_sender_are_counted():
    kept = History(ROW, 100)
    kept.append(table(5, 10))
    kept.append(table(18, 2))
    assert kept.lost == 3
    assert kept.head == 12
