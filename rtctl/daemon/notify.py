"""What a service manager is told: ready, alive, reloading, stopping. Datagrams to $NOTIFY_SOCKET, as sd_notify(3) does.

A process that no service manager started has no such socket, and then nothing here does anything.

Source: sd_notify(3), sd_watchdog_enabled(3), systemd.service(5) for Type=notify-reload.
"""

import os
import socket
import time
from collections.abc import Callable, MutableMapping

import structlog

log = structlog.get_logger()
GOOD_TICKS = 100  # in time, one after the other, before a machine is called ready; a slow one is given a second
SEND_TIMEOUT = 1.0  # s; a manager that takes nothing for so long must not hold up the recording

Send = Callable[[str, bool], bool]  # (text, whether it may wait) -> whether it was taken


class Service:
    """This process as its service manager knows it.

    `send(text, wait)` delivers one message and returns whether it was taken; None where nobody listens. `watchdog` is
    the longest time in us between two signs of life, 0 where none are asked for. `clock()` is CLOCK_MONOTONIC in ns.
    `good_ticks` is how many ticks in a row must be in time before the machine is ready.
    """

    def __init__(
        self,
        send: Send | None = None,
        watchdog: int = 0,
        good_ticks: int = GOOD_TICKS,
        clock: Callable[[], int] = time.monotonic_ns,
    ):
        self._send, self._clock, self.good_ticks = send, clock, good_ticks
        self._half = watchdog * 1000 // 2  # ns
        self._ready = self._stopping = False
        self._text = ""
        self._from = (0, 0)  # tick and late ticks where the row of good ones began
        self._fed_at, self._fed_tick = clock(), 0

    @property
    def listens(self) -> bool:
        """Whether there is a service manager to talk to."""
        return self._send is not None

    def observe(self, tick: int, late: int) -> None:
        """Look at the counters of the loop: ready after enough good ticks, a sign of life for as long as it ticks.

        `tick` counts ticks done, `late` those that were late or missed. A tick counter that moves says that the config
        is valid, the tick compiled, and memory locked or its lack accepted: the loop does not start before.
        """
        if not self._ready and self._good(tick, late):
            self.ready()
        self.feed(tick)

    def ready(self, status: str = "") -> None:
        """Say READY=1, once, and not on the way down."""
        if not self._ready and not self._stopping:
            self._ready = True
            self._say("READY=1", *self._changed(status))

    def feed(self, tick: int) -> None:
        """Say WATCHDOG=1 after half of the time allowed, but only if the tick counter has moved since the last one."""
        now = self._clock()
        if not self._half or now - self._fed_at < self._half or tick == self._fed_tick:
            return
        if self._send is not None and self._send("WATCHDOG=1", False):  # one that is not taken is sent next time
            self._fed_at, self._fed_tick = now, tick

    def reloading(self) -> None:
        """Say RELOADING=1, with the time that tells the manager which of its requests is meant."""
        if self._ready and not self._stopping:
            self._say("RELOADING=1", f"MONOTONIC_USEC={self._clock() // 1000}")

    def reloaded(self, status: str = "") -> None:
        """Say that the reload is over. A machine that was not ready before is not made so by it."""
        if self._ready and not self._stopping:
            self._say("READY=1", *self._changed(status))

    def stopping(self) -> None:
        """Say STOPPING=1, once."""
        if not self._stopping:
            self._stopping = True
            self._say("STOPPING=1")

    def status(self, text: str) -> None:
        """One line for `systemctl status`; sent when it is another than before."""
        self._say(*self._changed(text))

    def _good(self, tick: int, late: int) -> bool:
        if late != self._from[1]:
            self._from = (tick, late)
        return tick - self._from[0] >= self.good_ticks

    def _changed(self, text: str) -> list[str]:
        text = " ".join(text.split())  # a new line would begin another assignment
        if not text or text == self._text:
            return []
        self._text = text
        return [f"STATUS={text}"]

    def _say(self, *assignments: str) -> None:
        if assignments and self._send is not None and not self._send("\n".join(assignments), True):
            log.warning("the service manager did not take a message", message=assignments[0])


def from_environment(
    environ: MutableMapping[str, str] | None = None, rate: float = GOOD_TICKS, clock: Callable[[], int] | None = None
) -> Service:
    """The service that $NOTIFY_SOCKET and $WATCHDOG_USEC describe, for a loop of `rate` in Hz.

    Takes the variables out of the environment: children must not speak for the daemon. An address that cannot be
    reached is logged and means that nobody listens.
    """
    environ = os.environ if environ is None else environ
    address = environ.pop("NOTIFY_SOCKET", "")
    usec, pid = environ.pop("WATCHDOG_USEC", ""), environ.pop("WATCHDOG_PID", "")
    send = _sender(address) if address else None
    watched = usec.isascii() and usec.isdigit() and pid in ("", str(os.getpid()))
    good = max(1, min(GOOD_TICKS, int(rate)))
    return Service(send, int(usec) if watched else 0, good, clock or time.monotonic_ns)


def _sender(address: str) -> Send | None:
    """Sends to a socket in the file system, or to an abstract one, whose name is written with an @ in front."""
    link = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
    try:
        link.connect("\0" + address[1:] if address.startswith("@") else address)
    except OSError as error:
        link.close()
        log.warning("nobody listens at NOTIFY_SOCKET", address=address, error=str(error))
        return None

    def send(text: str, wait: bool) -> bool:
        link.settimeout(SEND_TIMEOUT if wait else 0.0)
        try:
            link.send(text.encode())
        except OSError:
            return False
        return True

    return send
