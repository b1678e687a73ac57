import ctypes
import os
import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from rtctl.loop import realtime
from rtctl.loop.realtime import RealTime


class Kernel:
    """Stub of the kernel; refuses the requests named in `refuses`."""

    def __init__(self, patch: pytest.MonkeyPatch):
        self.refuses: set[str] = set()
        self.cpus = {0, 1, 2}
        self.asked: dict[str, Any] = {}
        patch.setattr(
            os, "sched_setscheduler", lambda pid, policy, param: self._ask("fifo", (policy, param.sched_priority))
        )
        patch.setattr(os, "sched_setaffinity", lambda pid, cpus: self._ask("pin", cpus))
        patch.setattr(os, "sched_getaffinity", lambda pid: self.cpus)
        patch.setattr(ctypes, "CDLL", lambda *_, **__: self)
        patch.setattr(realtime.gc, "freeze", lambda: None)
        patch.setattr(realtime.gc, "unfreeze", lambda: None)
        opened, written = os.open, os.write
        patch.setattr(
            os, "open", lambda path, *a, **k: self._latency() if "latency" in str(path) else opened(path, *a, **k)
        )
        patch.setattr(os, "write", lambda fd, data: self._ask("zero", data) if fd == -7 else written(fd, data))
        closed = os.close
        patch.setattr(os, "close", lambda fd: self._ask("closed", fd) if fd == -7 else closed(fd))

    def _latency(self) -> int:
        self._ask("latency", True)
        return -7

    def mlockall(self, flags: int) -> int:
        self.asked["lock"] = flags
        return -1 if "lock" in self.refuses else 0

    def munlockall(self) -> int:
        self.asked["unlock"] = True
        return 0

    def _ask(self, what: str, value: Any) -> None:
        if what in self.refuses:
            raise PermissionError(1, "Operation not permitted")
        self.asked[what] = value


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Iterator[Kernel]:
    with monkeypatch.context() as patch:
        yield Kernel(patch)


def test_real_time_setup_makes_all_requests(kernel: Kernel) -> None:
    made = RealTime(80, None)
    assert made.lacks == []
    assert kernel.asked["fifo"] == (os.SCHED_FIFO, 80)
    assert kernel.asked["lock"] == 3 and kernel.asked["pin"] == {2}
    assert kernel.asked["zero"] == bytes(4) and not {"closed", "unlock"} & set(kernel.asked)
    made.close()
    made.close()
    assert kernel.asked["closed"] == -7 and kernel.asked["unlock"]


@pytest.mark.parametrize(
    ("refused", "what", "remedy"),
    [
        ("fifo", "no SCHED_FIFO", "LimitRTPRIO"),
        ("lock", "memory is not locked", "LimitMEMLOCK"),
        ("pin", "not on CPU 2", "allowed are 0, 1, 2: set loop.cpu to one of them"),
        ("latency", "no access to /dev/cpu_dma_latency", "write access"),
    ],
)
def test_refused_request_is_named_with_its_remedy(kernel: Kernel, refused: str, what: str, remedy: str) -> None:
    kernel.refuses = {refused}
    (lack,) = RealTime(80, None).lacks
    assert lack.what == what and remedy in lack.remedy and str(lack).startswith(f"{what}: ")


def test_all_refused_requests_are_named(kernel: Kernel) -> None:
    kernel.refuses = {"fifo", "lock", "pin", "latency"}
    assert len(RealTime(80, 1).lacks) == 4


def test_single_cpu_is_reported_unless_it_was_chosen(kernel: Kernel) -> None:
    kernel.cpus = {0}
    (lack,) = RealTime(80, None).lacks
    assert lack.what == "one CPU only"
    assert RealTime(80, 0).lacks == [] and kernel.asked["pin"] == {0}


def test_memory_of_the_process_is_unlocked_at_the_end() -> None:
    """Locked memory would be filled at every allocation, for the rest of the process."""
    thread = threading.Thread(target=lambda: RealTime(1, None).close())
    thread.start()
    thread.join()
    status = Path("/proc/self/status").read_text()
    assert re.search(r"VmLck:\s+0 kB", status)
