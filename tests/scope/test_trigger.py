import numpy as np
import pytest

from rtctl.scope.trigger import Trigger, crossings


@pytest.mark.parametrize(("edge", "found"), [("rising", [2, 6]), ("falling", [4, 8]), ("either", [2, 4, 6, 8])])
def test_crossing_is_the_first_row_at_or_beyond_the_level(edge, found):
    assert crossings(np.array([0, 0, 1, 2, 1, 0, 1, 2, 0.0]), 1.0, edge).tolist() == found


def square(t):
    return (t * 1000 // 100) % 2  # 100 rows low, 100 rows high: rises at 100, 300, 500 ...


def feed(trigger, history, rows, count, block):
    """All sweeps from `count` rows in blocks of `block`."""
    found = []
    for first in range(history.head, history.head + count, block):
        history.append(rows(first, block, square))
        found.append(trigger.feed(history, "u"))
    return [sweep for sweep in found if sweep is not None]


@pytest.mark.parametrize("block", [1, 7, 50])
def test_sweeps_contain_their_crossing_for_any_block_size(history, rows, block):
    trigger = Trigger(0.5, "rising", rows=150, before=30, single=False, start=0)
    found = feed(trigger, history, rows, 1050, block)
    assert found == [(at - 30, at, at + 120) for at in (100, 300, 500, 700, 900)]
    assert trigger.count == 5


def test_next_crossing_counts_only_after_the_last_sweep(history, rows):
    found = feed(Trigger(0.5, "rising", rows=250, before=0, single=False, start=0), history, rows, 1000, 10)
    assert [sweep.at for sweep in found] == [100, 500]


def test_newest_of_several_sweeps_is_shown_and_all_are_counted(history, rows):
    trigger = Trigger(0.5, "rising", rows=20, before=5, single=False, start=0)
    assert [sweep.at for sweep in feed(trigger, history, rows, 1000, 1000)] == [900]
    assert trigger.count == 5


def test_single_mode_shows_the_first_sweep(history, rows):
    trigger = Trigger(0.5, "rising", rows=20, before=5, single=True, start=0)
    assert [sweep.at for sweep in feed(trigger, history, rows, 1000, 1000)] == [100]
    assert trigger.done


def test_rows_before_the_trigger_was_set_do_not_count(history, rows):
    history.append(rows(0, 450, square))
    trigger = Trigger(0.5, "rising", rows=20, before=5, single=False, start=history.head)
    assert [sweep.at for sweep in feed(trigger, history, rows, 100, 10)] == [500]
