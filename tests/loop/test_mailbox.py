import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rtctl.idiom import state, tick
from rtctl.loop import mailbox
from rtctl.tick.memory import Segment

PARAMS = state(gain=(float, 64))
BOX = mailbox.mailbox_dtype(PARAMS)


@tick
def take_until(box, staged, p, c, last):
    """Take messages in a busy loop until number `last` arrives; returns the number of torn messages."""
    mixed = 0
    while c[0].arm < last:
        if mailbox.take(box, staged, p, c) == 1:
            for i in range(64):
                if p[0].gain[i] != c[0].arm:
                    mixed += 1
    return mixed


class Two:
    def __init__(self, folder: Path):
        segment = Segment.create(folder / "s", {"mailbox": (BOX, 1)})
        self.box, self.end = segment["mailbox"], mailbox.Mailbox(segment)
        self.own = (np.zeros(1, BOX), np.zeros(1, PARAMS), np.zeros(1, mailbox.COMMAND))

    @property
    def p(self) -> Any:
        return self.own[1][0]

    @property
    def c(self) -> Any:
        return self.own[2][0]

    def take(self) -> int:
        return mailbox.take(self.box, *self.own)


@pytest.fixture
def two(tmp_path: Path) -> Two:
    return Two(tmp_path)


def numbered(n: int) -> Any:
    def write(params: Any, command: Any) -> None:
        params["gain"] = n
        command["arm"] = n

    return write


def test_message_is_taken_once(two: Two) -> None:
    assert two.take() == 0
    count = two.end.post(numbered(3))
    assert two.end.seen < count
    assert two.take() == 1 and two.c["arm"] == 3 and (two.p["gain"] == 3).all()
    assert two.end.seen == count
    assert two.take() == 0


def test_newest_of_two_messages_is_taken(two: Two) -> None:
    two.end.post(numbered(1))
    two.end.post(numbered(2))
    assert two.take() == 1 and two.c["arm"] == 2
    assert two.take() == 0


def test_message_is_not_taken_while_it_is_written(two: Two) -> None:
    inside = []

    def write(params: Any, command: Any) -> None:
        numbered(5)(params, command)
        inside.append(two.take())

    two.end.post(write)
    assert inside == [0]
    assert two.take() == 1 and two.c["arm"] == 5


def test_torn_messages_are_never_taken(two: Two) -> None:
    last = 20_000
    found: list[int] = []
    two.end.post(numbered(0))
    assert take_until(two.box, *two.own, 0) == 0  # compiled
    reader = threading.Thread(target=lambda: found.append(take_until(two.box, *two.own, last)))
    reader.start()
    for n in range(1, last + 1):
        two.end.post(numbered(n))
    reader.join(20)
    assert found == [0]
