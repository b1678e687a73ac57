import os
import socket
from pathlib import Path

import pytest

from rtctl.daemon.notify import GOOD_TICKS, Service, from_environment

MS = 1_000_000  # ns


class Manager:
    """What was sent, and a clock in ns that the test moves. `deaf` takes nothing."""

    def __init__(self) -> None:
        self.said: list[str] = []
        self.now = 5 * MS
        self.deaf = False

    def send(self, text: str, wait: bool) -> bool:
        if not self.deaf:
            self.said.append(text)
        return not self.deaf

    def service(self, watchdog: int = 0, good_ticks: int = 100) -> Service:
        return Service(self.send, watchdog, good_ticks, lambda: self.now)


@pytest.fixture
def manager() -> Manager:
    return Manager()


# ready


def test_ready_after_enough_good_ticks_and_once(manager: Manager) -> None:
    service = manager.service()
    for tick in (0, 40, 99):
        service.observe(tick, 0)
    assert manager.said == []
    service.observe(100, 0)
    service.observe(500, 0)
    service.ready()
    assert manager.said == ["READY=1"]


def test_a_late_tick_begins_the_count_again(manager: Manager) -> None:
    service = manager.service()
    service.observe(90, 0)
    service.observe(100, 1)
    service.observe(199, 1)
    assert manager.said == []
    service.observe(210, 2)
    service.observe(309, 2)
    assert manager.said == []
    service.observe(310, 2)
    assert manager.said == ["READY=1"]


def test_a_loop_that_never_ticks_is_never_ready(manager: Manager) -> None:
    service = manager.service(watchdog=2000)
    for _ in range(100):
        manager.now += 10 * MS
        service.observe(0, 0)
    assert manager.said == []


@pytest.mark.parametrize(("rate", "good"), [(10_000.0, GOOD_TICKS), (500.0, GOOD_TICKS), (20.0, 20), (0.2, 1)])
def test_good_ticks_are_a_hundred_or_a_second(rate: float, good: int) -> None:
    assert from_environment({}, rate).good_ticks == good


# signs of life


def test_fed_at_half_of_the_time_and_only_when_the_counter_moves(manager: Manager) -> None:
    service = manager.service(watchdog=200_000)
    start = manager.now

    def feed(ms: int, tick: int) -> int:
        manager.now = start + ms * MS
        service.feed(tick)
        return len(manager.said)

    assert feed(99, 50) == 0  # too early
    assert feed(100, 51) == 1
    assert feed(150, 70) == 1
    assert feed(200, 51) == 1  # it has not moved since the last sign of life
    assert feed(900, 51) == 1
    assert feed(901, 52) == 2  # and as soon as it does
    assert set(manager.said) == {"WATCHDOG=1"}


def test_no_sign_of_life_where_none_is_asked_for(manager: Manager) -> None:
    service = manager.service(watchdog=0)
    manager.now += 1000 * MS
    service.feed(7)
    assert manager.said == []


def test_a_sign_of_life_that_was_not_taken_is_sent_again(manager: Manager) -> None:
    service = manager.service(watchdog=200_000)
    manager.now += 100 * MS
    manager.deaf = True
    service.feed(1)
    manager.deaf = False
    service.feed(1)
    assert manager.said == ["WATCHDOG=1"]


# reload, stop, status


def test_reload_carries_the_time_in_microseconds(manager: Manager) -> None:
    service = manager.service()
    service.ready()
    manager.now = 123_456_789
    service.reloading()
    service.reloaded("2 values taken over")
    assert manager.said[1:] == ["RELOADING=1\nMONOTONIC_USEC=123456", "READY=1\nSTATUS=2 values taken over"]


def test_a_reload_makes_nothing_ready_and_revives_nothing(manager: Manager) -> None:
    service = manager.service()
    service.reloading()
    service.reloaded()
    assert manager.said == []
    service.ready()
    service.stopping()
    service.reloading()
    service.reloaded()
    service.stopping()
    assert manager.said == ["READY=1", "STOPPING=1"]


def test_nothing_becomes_ready_on_the_way_down(manager: Manager) -> None:
    service = manager.service()
    service.stopping()
    service.observe(1000, 0)
    assert manager.said == ["STOPPING=1"]


def test_status_is_one_line_and_said_when_it_changes(manager: Manager) -> None:
    service = manager.service()
    for text in ("idle", "idle", "running\nREADY=1", "", "idle"):
        service.status(text)
    assert manager.said == ["STATUS=idle", "STATUS=running READY=1", "STATUS=idle"]


def test_a_manager_that_takes_nothing_stops_nobody(manager: Manager) -> None:
    manager.deaf = True
    service = manager.service()
    service.ready("idle")
    service.stopping()


def test_without_a_manager_nothing_happens() -> None:
    service = from_environment({})
    service.observe(1000, 0)
    service.reloading()
    service.stopping()
    assert not service.listens


# the socket


@pytest.fixture
def listener() -> socket.socket:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as made:
        made.settimeout(5.0)
        yield made


def test_a_socket_in_the_file_system(listener: socket.socket, runtime: Path) -> None:
    path = runtime / "notify-file"
    listener.bind(str(path))
    environ = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "2000000", "WATCHDOG_PID": str(os.getpid()), "HOME": "/"}
    service = from_environment(environ)
    assert environ == {"HOME": "/"}  # children must not speak for the daemon
    service.ready("idle")
    assert listener.recv(100) == b"READY=1\nSTATUS=idle"


def test_an_abstract_socket(listener: socket.socket) -> None:
    name = f"rtctl-test-{os.getpid()}"
    listener.bind(f"\0{name}")
    from_environment({"NOTIFY_SOCKET": f"@{name}"}).ready()
    assert listener.recv(100) == b"READY=1"


@pytest.mark.parametrize(
    ("environ", "fed"),
    [
        ({"WATCHDOG_USEC": "200000"}, True),
        ({"WATCHDOG_USEC": "200000", "WATCHDOG_PID": "1"}, False),  # meant for another process
        ({"WATCHDOG_USEC": "soon"}, False),
        ({}, False),
    ],
)
def test_the_watchdog_of_the_environment(
    listener: socket.socket, environ: dict[str, str], fed: bool, request: pytest.FixtureRequest
) -> None:
    name = f"rtctl-test-{os.getpid()}-watchdog"
    listener.bind(f"\0{name}")
    now = [0]
    service = from_environment({**environ, "NOTIFY_SOCKET": f"@{name}"}, clock=lambda: now[0])
    now[0] = 100 * MS
    service.feed(5)
    service.stopping()
    assert listener.recv(100) == (b"WATCHDOG=1" if fed else b"STOPPING=1")


def test_an_address_that_nobody_listens_at_is_nobody(tmp_path: Path) -> None:
    service = from_environment({"NOTIFY_SOCKET": str(tmp_path / "gone")})
    assert not service.listens
    service.ready()


def test_a_full_socket_does_not_hold_up_a_sign_of_life(listener: socket.socket) -> None:
    name = f"rtctl-test-{os.getpid()}-full"
    listener.bind(f"\0{name}")
    now = [0]
    service = from_environment({"NOTIFY_SOCKET": f"@{name}", "WATCHDOG_USEC": "2"}, clock=lambda: now[0])
    for tick in range(1, 1000):  # the kernel keeps ten or so
        now[0] += MS
        service.feed(tick)
    assert 0 < sum(1 for _ in _waiting(listener)) < 999


def _waiting(listener: socket.socket):
    listener.setblocking(False)
    while True:
        try:
            yield listener.recv(100)
        except BlockingIOError:
            return
