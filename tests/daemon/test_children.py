"""Children that start before their orders are known."""

import pytest

from rtctl.daemon import children
from rtctl.daemon.children import dismiss, early, start_child


def test_waiting_child_gets_the_orders_and_others_are_ended() -> None:
    with early("loop", "plant"):
        waiting = dict(children._waiting)
        child = start_child("loop", {"config": {}})
        assert child is waiting["loop"] and child.order == {"config": {}}
        assert "rtctl.daemon.loop_process" in child.process.args
        dismiss()
        assert not waiting["plant"].running() and child.running()
        child.stop(0.0)
    assert not children._waiting


def test_child_without_an_early_start_is_started() -> None:
    child = start_child("plant", {})
    assert child.running() and "rtctl.daemon.plant_process" in child.process.args
    child.stop(0.0)


def test_dead_child_is_replaced() -> None:
    with early("loop"):
        waiting = children._waiting["loop"]
        waiting.process.kill()
        waiting.process.wait()
        child = start_child("loop", {})
        assert child.running() and child is not waiting
        child.stop(0.0)


def test_waiting_children_end_with_an_error() -> None:
    with pytest.raises(ZeroDivisionError), early("loop"):
        waiting = children._waiting["loop"]
        raise ZeroDivisionError
    assert not waiting.running() and not children._waiting


@pytest.mark.parametrize("role", ["loop", "plant"])
def test_child_whose_supervisor_ends_without_orders_says_nothing(role: str) -> None:
    child = children.ChildProcess(role)
    child.stop(30.0)
    assert child.process.returncode == 0 and child.last_words() == "" and not child.reports()


def test_orders_longer_than_a_pipe_arrive_whole() -> None:
    child = start_child("loop", {"config": {"machine": "seven", "own": {}, "note": "x" * (1 << 17)}})
    child.process.wait(30)
    assert child.process.returncode != 0 and "machine: 'seven' is not one of" in child.last_words()
