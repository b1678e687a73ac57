"""Real-time settings of a thread on Linux: SCHED_FIFO, locked memory, one CPU, no deep sleep of the CPU.

A setting that is not allowed is reported with its consequence and remedy. Nothing here runs in the tick.

Source: sched(7), mlock(2), /dev/cpu_dma_latency in the kernel's power management documentation.
"""

import ctypes
import gc
import os
from typing import NamedTuple

MCL_CURRENT, MCL_FUTURE = 1, 2


class Lack(NamedTuple):
    """A real-time setting that this computer or account does not allow, with its consequence and remedy."""

    what: str
    cost: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.what}: {self.cost}; {self.remedy}"


class RealTime:
    """Real-time settings of the calling thread. `lacks` lists refused settings. Keep the object: CPU sleep states stay
    limited, and memory locked, until `close`."""

    def __init__(self, priority: int, cpu: int | None):
        self.lacks: list[Lack] = []
        self._dma_latency: int | None = None
        gc.collect()
        gc.freeze()  # the collector ignores objects of the start-up from now on
        self._lock_memory()
        self._pin(cpu)
        self._no_deep_sleep()
        self._fifo(priority)

    def _fifo(self, priority: int) -> None:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        except OSError:
            self.lacks.append(
                Lack(
                    "no SCHED_FIFO",
                    "any other program can delay a tick by milliseconds",
                    "allow it with LimitRTPRIO=99 (systemd) or an rtprio line in /etc/security/limits.conf",
                )
            )

    def _lock_memory(self) -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        if libc.mlockall(MCL_CURRENT | MCL_FUTURE) != 0:
            self.lacks.append(
                Lack(
                    "memory is not locked",
                    "a page fault can delay a tick by milliseconds under memory pressure",
                    "allow it with LimitMEMLOCK=infinity or a memlock line in /etc/security/limits.conf",
                )
            )

    def _pin(self, cpu: int | None) -> None:
        allowed = sorted(os.sched_getaffinity(0))
        chosen = allowed[-1] if cpu is None else cpu
        if len(allowed) == 1 and cpu is None:
            self.lacks.append(
                Lack("one CPU only", "plant, supervisor and loop share it", "give this machine a second CPU")
            )
            return
        try:
            os.sched_setaffinity(0, {chosen})
        except OSError:
            self.lacks.append(
                Lack(
                    f"not on CPU {chosen}",
                    "the kernel may move the loop, at some microseconds each time",
                    f"allowed are {', '.join(map(str, allowed))}: set loop.cpu to one of them",
                )
            )

    def _no_deep_sleep(self) -> None:
        try:
            self._dma_latency = os.open("/dev/cpu_dma_latency", os.O_WRONLY)
            os.write(self._dma_latency, (0).to_bytes(4, "little"))
        except OSError:
            self.lacks.append(
                Lack(
                    "no access to /dev/cpu_dma_latency",
                    "the CPU may sleep deeply and wake some ten microseconds late",
                    "give the account write access to it, or disable deep C-states",
                )
            )

    def close(self) -> None:
        """Undo what outlives the thread: locked memory, frozen objects, the limit on sleep states."""
        ctypes.CDLL(None).munlockall()
        gc.unfreeze()
        if self._dma_latency is not None:
            os.close(self._dma_latency)
            self._dma_latency = None
