import time

import pytest

from rtctl.idiom import tick
from rtctl.tick import clock


@tick
def read():
    return clock.now()


@tick
def sleep(ns):
    """Lateness of the wake-up in ns, and the result of the call."""
    wake = clock.now() + ns
    result = clock.sleep_until(wake)
    return clock.now() - wake, result


def test_clock_agrees_with_the_clock_of_python() -> None:
    read()
    before = time.monotonic_ns()
    now = read()
    assert before <= now <= time.monotonic_ns()


def test_clock_never_runs_backwards() -> None:
    times = [read() for _ in range(1000)]
    assert times == sorted(times)


@pytest.mark.parametrize("ns", [1, 100_000, 2_000_000])
def test_sleep_never_wakes_early(ns: int) -> None:
    for _ in range(20):
        late, result = sleep(ns)
        assert result == 0 and late >= 0


def test_sleep_until_a_past_time_does_not_wait() -> None:
    past = time.monotonic_ns() // 2  # half of the uptime; earlier times do not exist
    late, result = sleep(-past)
    assert result == 0 and past <= late < past + 100 * clock.SECOND
