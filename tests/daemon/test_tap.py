"""Tap: a second reader of the ring that does not disturb the supervisor."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rtctl.daemon.tap import Tap, describe


@pytest.fixture
def machine(bench: Callable[..., Any], config: Callable[..., Any]) -> Any:
    return bench(config("ivu"), rows=1000)


def test_tap_returns_the_rows_of_the_supervisor(machine: Any) -> None:
    machine.run(0.1)
    tap = Tap(describe(machine.segment))
    assert len(tap.take()) == 0  # a tap starts at the newest row
    for seconds in (0.02, 1.0, 1.9, 0.4):  # the ring wraps around more than once
        rows = machine.run(seconds)
        assert tap.take().tobytes() == rows.tobytes()
    assert tap.lost == 0


def test_tap_returns_selected_columns(machine: Any) -> None:
    tap = Tap(describe(machine.segment))
    rows = machine.run(0.1)
    taken = tap.take(["t", "u1"])
    assert taken.dtype.names == ("t", "u1")
    assert np.array_equal(taken["u1"], rows["u1"]) and np.array_equal(taken["t"], rows["t"])


def test_late_tap_counts_the_rows_it_missed(machine: Any) -> None:
    tap = Tap(describe(machine.segment))
    for _ in range(3):
        rows = machine.run(1.0)
    taken = tap.take()
    assert taken["tick"][-1] == rows["tick"][-1]
    assert tap.lost + len(taken) == 1500
    assert tap.lost >= 500


def test_tap_does_not_move_the_read_position_of_the_supervisor(machine: Any) -> None:
    tap = Tap(describe(machine.segment))
    machine.loop.stretch(0, 250)
    assert len(tap.take()) == 250
    assert tap.filled == 0.25
    assert len(machine.reader.take()) == 250
    assert tap.filled == 0.0


def test_tap_refuses_the_ring_of_a_restarted_daemon(machine: Any) -> None:
    where = describe(machine.segment)
    machine.segment.unlink()
    machine.segment.path.write_bytes(bytes(100))
    where["inode"] = machine.segment.path.stat().st_ino + 1
    with pytest.raises(FileNotFoundError, match="of another daemon by now"):
        Tap(where)
