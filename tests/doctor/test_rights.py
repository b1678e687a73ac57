import os

import pytest

from rtctl.doctor import rights


def limits(rtprio: str = "0", memlock: str = "8388608") -> dict[str, str]:
    return {
        "proc/self/limits": f"Max locked memory         {memlock}   {memlock}   bytes\n"
        f"Max realtime priority     {rtprio}   {rtprio}\n"
    }


def test_fifo_check_does_not_change_this_thread():
    before = os.sched_getscheduler(0)
    assert rights.may_fifo(1) in (True, False)
    assert os.sched_getscheduler(0) == before


def test_refused_fifo_finding(monkeypatch):
    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert rights.may_fifo(80) is False


def test_fifo_finding(tree):
    good = rights.fifo(tree(limits(rtprio="99")), 80, True)
    assert (good.verdict, "RLIMIT_RTPRIO 99" in good.found, good.change) == ("good", True, "")
    bad = rights.fifo(tree(limits()), 80, False)
    assert (bad.verdict, "rtprio 99" in bad.command, "LimitRTPRIO" in bad.change) == ("bad", True, True)


def test_unreadable_limit_does_not_hide_the_tried_result(tree):
    assert rights.fifo(tree(), 80, True).verdict == "good"
    assert rights.fifo(tree(), 80, False).verdict == "bad"


@pytest.mark.parametrize(
    ("files", "verdict"),
    [
        (limits(memlock="unlimited"), "good"),
        (limits(), "bad"),
        ({**limits(), "proc/self/status": "CapEff:\t0000000000004000\n"}, "good"),
        ({}, "unknown"),
    ],
)
def test_memory_lock_finding(tree, files, verdict):
    said = rights.memory_lock(tree(files))
    assert said.verdict == verdict
    assert ("memlock unlimited" in said.command) == (verdict == "bad")
