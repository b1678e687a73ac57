import threading
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.idiom import tick
from rtctl.loop import ring
from rtctl.tick.memory import Segment

ROW = np.dtype([("tick", np.int64), ("x", np.float64, (30,))], align=True)  # long enough to be torn
CAPACITY = 8


@tick
def put_many(ring_, rows, row, first, count):
    for k in range(first, first + count):
        row[0].tick = k
        row[0].x[:] = float(k)
        ring.put(ring_, rows, row)


class Two:
    """Both ends of a ring."""

    def __init__(self, path: Path, capacity: int = CAPACITY):
        self.segment = Segment.create(path, {"ring": (ring.RING, 1), "rows": (ROW, capacity)})
        self.reader = ring.Reader(self.segment)
        self.row = np.zeros(1, ROW)
        self.written = 0

    def put(self, count: int) -> None:
        put_many(self.segment["ring"][0], self.segment["rows"], self.row, self.written, count)
        self.written += count


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3 * CAPACITY), st.one_of(st.none(), st.integers(0, 2 * CAPACITY)))))
def test_rows_written_equal_rows_read_plus_rows_lost(tmp_path_factory, turns: list) -> None:
    path = tmp_path_factory.getbasetemp() / "ring"
    path.unlink(missing_ok=True)  # file of the previous example
    two = Two(path)
    seen: list[int] = []
    gaps: list[int] = []
    for count, most in [*turns, (0, None)]:
        two.put(count)
        rows = two.reader.take(most)
        assert most is None or len(rows) <= most
        seen += rows["tick"].tolist()
        gaps += [t for first, n in two.reader.gaps for t in range(first, first + n)]
    assert sorted(seen + gaps) == list(range(two.written))  # each row once: read or counted as lost
    assert seen == sorted(seen) and two.reader.lost == len(gaps)


def test_newest_rows_survive_an_overflow(tmp_path: Path) -> None:
    two = Two(tmp_path / "ring")
    two.put(3)
    two.reader.take()
    two.put(20)
    rows = two.reader.take()
    assert rows["tick"][-1] == 22
    assert two.reader.gaps == [(3, 23 - 3 - len(rows))] and len(rows) >= CAPACITY - 1
    assert len(two.reader.take()) == 0 and two.reader.gaps == []


def test_full_ring_without_overflow_loses_no_rows(tmp_path: Path) -> None:
    two = Two(tmp_path / "ring")
    two.put(CAPACITY - 1)
    assert two.reader.take()["tick"].tolist() == list(range(CAPACITY - 1)) and two.reader.lost == 0


def test_taken_rows_are_copies(tmp_path: Path) -> None:
    two = Two(tmp_path / "ring")
    two.put(2)
    rows = two.reader.take()
    two.put(CAPACITY)
    assert rows["tick"].tolist() == [0, 1] and rows["x"][1, 5] == 1.0


def test_torn_rows_are_never_returned(tmp_path: Path) -> None:
    two = Two(tmp_path / "ring", 64)
    two.put(1)  # compiled
    count = 2_000_000
    writer = threading.Thread(target=two.put, args=(count,))
    writer.start()
    taken = last = 0
    while True:
        finished = not writer.is_alive()
        rows = two.reader.take()
        if len(rows):
            assert (rows["x"] == rows["tick"][:, None]).all()
            assert (np.diff(rows["tick"]) == 1).all() and rows["tick"][0] >= last
            last = int(rows["tick"][-1]) + 1
        taken += len(rows)
        if finished:
            break
    assert taken + two.reader.lost == count + 1
