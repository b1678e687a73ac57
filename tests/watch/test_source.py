"""Row source of a machine that stalls, disappears and restarts."""

from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.config.errors import UserError
from rtctl.watch import source
from rtctl.watch.source import LOOK, STILL, Source

ROW = np.dtype([("tick", np.int64)])


class Ring:
    """A ring that holds `waiting` rows."""

    waiting = 0

    def __init__(self, _):
        self.lost = 0

    def take(self):
        rows, Ring.waiting = np.zeros(Ring.waiting, ROW), 0
        return rows


class Daemon:
    """A daemon that answers while `there` is true."""

    def __init__(self):
        self.pid, self.there = 1, True

    def call(self, op, **_):
        if not self.there:
            raise UserError("no daemon answers")
        return {"pid": self.pid, "name": "m", "ring": {"path": "/dev/shm/m"}}


@pytest.fixture
def made(monkeypatch, tmp_path):
    about = tmp_path / "m.json"
    about.write_text('{"case": {"sample_rate": 500.0}}')
    monkeypatch.setattr(source, "Tap", Ring)
    monkeypatch.setattr(source.shared_memory, "segment_path", lambda name: tmp_path / f"{name}.segment")
    now = SimpleNamespace(at=0.0)
    daemon = Daemon()
    found = Source(daemon, lambda: now.at)
    found.begin()
    return found, daemon, now


def test_source_gives_rows_and_case(made):
    found, _, _ = made
    assert found.case == {"sample_rate": 500.0}
    Ring.waiting = 7
    assert len(found.take().rows) == 7


def test_stalled_rows_are_noted_once(made):
    found, _, now = made
    now.at += STILL + 0.1
    assert "no rows for 3 s" in found.take().notes[0]
    now.at += LOOK + 0.1
    assert found.take().notes == ()
    Ring.waiting = 1
    assert found.take().notes == ()


def test_restarted_daemon_is_a_new_machine(made):
    found, daemon, now = made
    daemon.there = False
    now.at += STILL + 0.1
    gone = found.take()
    assert gone.rows is None and "has gone" in gone.notes[0]
    daemon.there, daemon.pid = True, 2
    assert found.take().rows is None  # the source looks for a daemon once a second
    now.at += LOOK + 0.1
    back = found.take()
    assert back.begun and "started anew, pid 2" in back.notes[0]


def test_inaccessible_ring_is_reported(made, monkeypatch):
    found, _, _ = made

    def refuses(_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(source, "Tap", refuses)
    with pytest.raises(UserError, match="out of reach"):
        found.begin()


def test_daemon_that_was_busy_is_not_a_new_machine(made):
    found, daemon, now = made
    daemon.there = False
    now.at += STILL + 0.1
    assert found.take().rows is None
    daemon.there = True
    now.at += LOOK + 0.1
    back = found.take()
    assert not back.begun
    assert "answers again" in back.notes[0]
