"""Messages to a service manager: ready, alive, reloading, stopping. Datagrams to $NOTIFY_SOCKET, as in sd_notify(3).

Without a service manager there is no $NOTIFY_SOCKET, and these functions do nothing.

Source: sd_notify(3), sd_watchdog_enabled(3), systemd.service(5) for Type=notify-reload.
"""

import os
import socket
import time
from collections.abc import Callable, MutableMapping

from rtctl.daemon.log import log

GOOD_TICKS = 100  # consecutive ticks in time before a machine is ready; below 100 Hz the ticks of one second
SEND_TIMEOUT = 1.0  # s to wait for the service manager, so that a hung manager does not delay the recording

Send = Callable[[str, bool], bool]  # (text, whether it may wait) -> whether it was sent


class Service:
    """State of this process towards its service manager.

    `send(text, wait)` sends one message and returns whether it was sent; None without a manager. `watchdog` is the
    longest time in us between two WATCHDOG=1 messages, 0 for no watchdog. `clock()` is CLOCK_MONOTONIC in ns.
    `good_ticks` is the number of consecutive ticks in time before the machine is ready.
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
        self._from = (0, 0)  # tick and count of late ticks at the last late tick
        self._fed_at, self._fed_tick = clock(), 0

    @property
    def listens(self) -> bool:
        """Whether there is a service manager."""
        return self._send is not None

    def observe(self, tick: int, late: int) -> None:
        """Check the loop's counters: send READY=1 after `good_ticks` ticks in time, and WATCHDOG=1 while it ticks.

        `tick` counts ticks done, `late` late or missed ticks. The loop ticks only after the config is valid, the tick
        is compiled, and memory is locked or its lack accepted.
        """
        if not self._ready and self._good(tick, late):
            self.ready()
        self.feed(tick)

    def ready(self, status: str = "") -> None:
        """Send READY=1, once, and not after STOPPING=1."""
        if not self._ready and not self._stopping:
            self._ready = True
            self._say("READY=1", *self._changed(status))

    def feed(self, tick: int) -> None:
        """Send WATCHDOG=1 after half of the watchdog time, but only if the tick counter has advanced since the last."""
        now = self._clock()
        if not self._half or now - self._fed_at < self._half or tick == self._fed_tick:
            return
        if self._send is not None and self._send("WATCHDOG=1", False):  # a failed message is sent again next time
            self._fed_at, self._fed_tick = now, tick

    def reloading(self) -> None:
        """Send RELOADING=1 with the monotonic time, by which the manager identifies its request."""
        if self._ready and not self._stopping:
            self._say("RELOADING=1", f"MONOTONIC_USEC={self._clock() // 1000}")

    def reloaded(self, status: str = "") -> None:
        """Send READY=1 after a reload, only if the machine was ready before."""
        if self._ready and not self._stopping:
            self._say("READY=1", *self._changed(status))

    def stopping(self) -> None:
        """Send STOPPING=1, once."""
        if not self._stopping:
            self._stopping = True
            self._say("STOPPING=1")

    def status(self, text: str) -> None:
        """Send a line for `systemctl status`, if the line has changed."""
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
    """Service by $NOTIFY_SOCKET and $WATCHDOG_USEC, for a loop of `rate` in Hz.

    Removes the variables from the environment, so that children do not send messages for the daemon. An unreachable
    address is logged and counts as no service manager.
    """
    environ = os.environ if environ is None else environ
    address = environ.pop("NOTIFY_SOCKET", "")
    usec, pid = environ.pop("WATCHDOG_USEC", ""), environ.pop("WATCHDOG_PID", "")
    send = _sender(address) if address else None
    watched = usec.isascii() and usec.isdigit() and pid in ("", str(os.getpid()))
    good = max(1, min(GOOD_TICKS, int(rate)))
    return Service(send, int(usec) if watched else 0, good, clock or time.monotonic_ns)


def _sender(address: str) -> Send | None:
    """Function that sends to a unix socket in the file system, or to an abstract one (name with a leading @)."""
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
