import os
import socket
from pathlib import Path

import pytest

from rtctl.daemon.notify import GOOD_TICKS, Service, from_environment

MS = 1_000_000  # ns


class Manager:
    """Stub of the service manager: sent messages, and a clock (ns) set by the test. `deaf` refuses messages."""

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


def test_ready_is_sent_once_after_enough_good_ticks(manager: Manager) -> None:
    service = manager.service()
    for tick in (0, 40, 99):
        service.observe(tick, 0)
    assert manager.said == []
    service.observe(100, 0)
    service.observe(500, 0)
    service.ready()
    assert manager.said == ["READY=1"]


def test_late_tick_restarts_the_count_of_good_ticks(manager: Manager) -> None:
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


def test_loop_that_never_ticks_is_never_ready(manager: Manager) -> None:
    service = manager.service(watchdog=2000)
    for _ in range(100):
        manager.now += 10 * MS
        service.observe(0, 0)
    assert manager.said == []


@pytest.mark.parametrize(("rate", "good"), [(10_000.0, GOOD_TICKS), (500.0, GOOD_TICKS), (20.0, 20), (0.2, 1)])
def test_required_good_ticks_are_a_hundred_or_one_second_of_ticks(rate: float, good: int) -> None:
    assert from_environment({}, rate).good_ticks == good


# watchdog


def test_watchdog_is_fed_at_half_its_time_and_only_when_the_tick_counter_moves(manager: Manager) -> None:
    service = manager.service(watchdog=200_000)
    start = manager.now

    def feed(ms: int, tick: int) -> int:
        manager.now = start + ms * MS
        service.feed(tick)
        return len(manager.said)

    assert feed(99, 50) == 0  # too early
    assert feed(100, 51) == 1
    assert feed(150, 70) == 1
    assert feed(200, 51) == 1  # the counter has not changed since the last watchdog message
    assert feed(900, 51) == 1
    assert feed(901, 52) == 2  # the counter has changed
    assert set(manager.said) == {"WATCHDOG=1"}


def test_no_watchdog_message_without_a_watchdog(manager: Manager) -> None:
    service = manager.service(watchdog=0)
    manager.now += 1000 * MS
    service.feed(7)
    assert manager.said == []


def test_refused_watchdog_message_is_sent_again(manager: Manager) -> None:
    service = manager.service(watchdog=200_000)
    manager.now += 100 * MS
    manager.deaf = True
    service.feed(1)
    manager.deaf = False
    service.feed(1)
    assert manager.said == ["WATCHDOG=1"]


# reload, stop, status


def test_reload_message_carries_the_time_in_microseconds(manager: Manager) -> None:
    service = manager.service()
    service.ready()
    manager.now = 123_456_789
    service.reloading()
    service.reloaded("2 values taken over")
    assert manager.said[1:] == ["RELOADING=1\nMONOTONIC_USEC=123456", "READY=1\nSTATUS=2 values taken over"]


def test_reload_does_not_make_a_starting_or_stopping_service_ready(manager: Manager) -> None:
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


def test_stopping_service_does_not_become_ready(manager: Manager) -> None:
    service = manager.service()
    service.stopping()
    service.observe(1000, 0)
    assert manager.said == ["STOPPING=1"]


def test_status_is_one_line_and_sent_when_it_changes(manager: Manager) -> None:
    service = manager.service()
    for text in ("idle", "idle", "running\nREADY=1", "", "idle"):
        service.status(text)
    assert manager.said == ["STATUS=idle", "STATUS=running READY=1", "STATUS=idle"]


def test_unresponsive_manager_does_not_block_the_service(manager: Manager) -> None:
    manager.deaf = True
    service = manager.service()
    service.ready("idle")
    service.stopping()


def test_service_without_a_manager_sends_nothing() -> None:
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


def test_notify_socket_in_the_file_system(listener: socket.socket, runtime: Path) -> None:
    path = runtime / "notify-file"
    listener.bind(str(path))
    environ = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "2000000", "WATCHDOG_PID": str(os.getpid()), "HOME": "/"}
    service = from_environment(environ)
    assert environ == {"HOME": "/"}  # child processes must not notify for the daemon
    service.ready("idle")
    assert listener.recv(100) == b"READY=1\nSTATUS=idle"


def test_abstract_notify_socket(listener: socket.socket) -> None:
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
def test_watchdog_settings_are_read_from_the_environment(
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


def test_notify_socket_without_a_listener_is_ignored(tmp_path: Path) -> None:
    service = from_environment({"NOTIFY_SOCKET": str(tmp_path / "gone")})
    assert not service.listens
    service.ready()


def test_full_notify_socket_does_not_block(listener: socket.socket) -> None:
    name = f"rtctl-test-{os.getpid()}-full"
    listener.bind(f"\0{name}")
    now = [0]
    service = from_environment({"NOTIFY_SOCKET": f"@{name}", "WATCHDOG_USEC": "2"}, clock=lambda: now[0])
    for tick in range(1, 1000):  # the kernel queues about ten
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
