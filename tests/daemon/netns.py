"""Two emulated hosts: a network namespace each, and a cable between them with delay, loss or an interruption.

The cable is a veth pair shaped by `tc netem`. Without netem in the kernel, the cable is a pair of tun devices; a thread
forwards the packets between them with the delay and the loss.
"""

import contextlib
import fcntl
import heapq
import itertools
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Sequence
from pathlib import Path

LOOP, PLANT = "10.77.0.1", "10.77.0.2"
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
MTU = 1500
number = itertools.count(1)


class NotHereError(Exception):
    """This machine allows no network namespaces, or no cable between them; the message names the missing part."""


def run(*command: str) -> None:
    """Run a command that must succeed. A failure raises NotHereError with the output of the command."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise NotHereError(f"`{' '.join(command)}` failed: {done.stderr.strip()}")


def sweep() -> None:
    """Remove namespaces of tests that were killed."""
    for left in Path("/run/netns").glob("rtctl*-*-*"):
        owner = left.name.removeprefix("rtctl").partition("-")[0]
        if owner.isdigit() and not Path(f"/proc/{owner}").exists():
            subprocess.run(["ip", "netns", "del", left.name], check=False)


class TwoHosts:
    """A context: the namespaces `loop` and `plant` with the addresses LOOP and PLANT. Leaving it removes both."""

    def __init__(self) -> None:
        tag = f"rtctl{os.getpid()}-{next(number)}"
        self.loop, self.plant = f"{tag}-loop", f"{tag}-plant"
        self._stack = contextlib.ExitStack()
        self._wire: Wire | None = None

    def __enter__(self) -> "TwoHosts":
        if shutil.which("ip") is None or shutil.which("tc") is None:
            raise NotHereError("there are no `ip` and `tc` here; they come with iproute2")
        if os.geteuid() != 0:
            raise NotHereError("network namespaces need root (CAP_SYS_ADMIN and CAP_NET_ADMIN)")
        sweep()
        with contextlib.ExitStack() as stack:
            for name in (self.loop, self.plant):
                run("ip", "netns", "add", name)
                stack.callback(subprocess.run, ["ip", "netns", "del", name], check=False)
                run("ip", "-n", name, "link", "set", "lo", "up")
            try:
                self._veth()
            except NotHereError as reason:
                self._tun(stack, reason)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def shape(self, delay: float = 0.0, loss: float = 0.0) -> None:
        """Each packet takes `delay` s and is lost with a probability of `loss`, in both directions."""
        if self._wire is not None:
            self._wire.delay, self._wire.loss = delay, loss
            return
        for name in (self.loop, self.plant):
            shape = ["netem", "delay", f"{delay * 1e6:.0f}us", "loss", f"{loss * 100:g}%"]
            run("tc", "-n", name, "qdisc", "replace", "dev", "cable", "root", *shape)

    def _veth(self) -> None:
        run("ip", "-n", self.loop, "link", "add", "cable", "type", "veth", "peer", "cable", "netns", self.plant)
        try:
            self._addresses()
            self.shape()
        except NotHereError:
            run("ip", "-n", self.loop, "link", "del", "cable")
            raise

    def _tun(self, stack: contextlib.ExitStack, netem: NotHereError) -> None:
        ends = []
        for end, name in (("a", self.loop), ("b", self.plant)):
            device = f"rt{os.getpid()}{end}{next(number)}"
            try:
                tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
                stack.callback(os.close, tun)
                fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH", device.encode(), IFF_TUN | IFF_NO_PI))
            except OSError as error:
                raise NotHereError(f"{netem}; and no tun device either: {error.strerror}") from None
            run("ip", "link", "set", device, "netns", name, "name", "cable")
            ends.append(tun)
        self._addresses()
        self._wire = Wire(ends)
        stack.callback(self._wire.close)  # before the devices are closed

    def _addresses(self) -> None:
        for name, own, peer in ((self.loop, LOOP, PLANT), (self.plant, PLANT, LOOP)):
            run("ip", "-n", name, "addr", "add", own, "peer", peer, "dev", "cable")
            run("ip", "-n", name, "link", "set", "cable", "up")


class Wire:
    """Carries packets between two tun devices, both ways, in a thread."""

    def __init__(self, ends: Sequence[int]):
        self.delay = self.loss = 0.0
        self.carried = self.dropped = 0
        self._ends = ends
        self._random = random.Random(1)
        self._wake, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._carry, name="wire", daemon=True)
        self._thread.start()

    def close(self) -> None:
        os.close(self._stop)
        self._thread.join()
        os.close(self._wake)

    def _carry(self) -> None:
        other = dict(zip(self._ends, reversed(self._ends), strict=True))
        waiting: list[tuple[float, int, int, bytes]] = []
        order = itertools.count()
        while True:
            timeout = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
            ready, _, _ = select.select([self._wake, *self._ends], [], [], timeout)
            if self._wake in ready:
                return
            for end in ready:
                packet = os.read(end, MTU + 64)
                if self._random.random() < self.loss:
                    self.dropped += 1
                else:
                    heapq.heappush(waiting, (time.monotonic() + self.delay, next(order), other[end], packet))
            while waiting and waiting[0][0] <= time.monotonic():
                *_, end, packet = heapq.heappop(waiting)
                with contextlib.suppress(OSError):  # the far end is down: the packet is lost
                    os.write(end, packet)
                    self.carried += 1


class Host:
    """One host: a runtime folder, keys, and `rtctl` run inside its namespace."""

    def __init__(self, namespace: str, folder: Path):
        self.namespace, self.runtime, self.config = namespace, folder / "run", folder / "config"
        for made in (self.runtime, self.config):
            made.mkdir(parents=True, mode=0o700)
        self.environment = {**os.environ, "XDG_RUNTIME_DIR": str(self.runtime), "XDG_CONFIG_HOME": str(self.config)}

    @property
    def keys(self) -> Path:
        return self.config / "rtctl" / "keys"

    def popen(self, *command: str) -> subprocess.Popen[str]:
        """A program on this host. The program ends with the test process, also when the test process is killed."""
        bound = ["setpriv", "--pdeathsig", "TERM"] if shutil.which("setpriv") else []
        inside = ["ip", "netns", "exec", self.namespace, *bound, *command]
        return subprocess.Popen(inside, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=self.environment)
