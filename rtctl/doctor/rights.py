"""Checks of this account's rights: SCHED_FIFO and locked memory.

Source: sched(7), mlock(2), capabilities(7), limits.conf(5).
"""

import os
import threading

from rtctl.doctor.finding import Finding, Tree

CAP_IPC_LOCK, CAP_SYS_NICE = 14, 23
LIMITS = "/etc/security/limits.d/rtctl.conf"


def may_fifo(priority: int) -> bool:
    """Whether a thread gets SCHED_FIFO at this priority; a short thread asks for it."""
    allowed = False

    def ask() -> None:
        nonlocal allowed
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))  # 0: the calling thread
            allowed = True
        except OSError:
            pass

    thread = threading.Thread(target=ask, name="fifo")
    thread.start()
    thread.join()
    return allowed


def fifo(tree: Tree, priority: int, allowed: bool) -> Finding:
    """Check of the right to SCHED_FIFO; `allowed` is the result of `may_fifo`."""
    limit = tree.limit("Max realtime priority")
    words = "RLIMIT_RTPRIO is hidden" if limit is None else f"RLIMIT_RTPRIO {limit:g}"
    if tree.capable(CAP_SYS_NICE):
        words += ", CAP_SYS_NICE"
    if allowed:
        return Finding("SCHED_FIFO", f"allowed at priority {priority}; {words}", "good")
    return Finding(
        "SCHED_FIFO", f"refused at priority {priority}; {words}", "bad",
        "any other program can delay a tick by milliseconds",
        "allow it and log in again; a systemd service has LimitRTPRIO=99, a container needs --cap-add SYS_NICE",
        f'echo "$USER - rtprio 99" | sudo tee -a {LIMITS}',
    )  # fmt: skip


def memory_lock(tree: Tree) -> Finding:
    """Check of the right to lock memory."""
    name, limit = "memory lock", tree.limit("Max locked memory")
    if tree.capable(CAP_IPC_LOCK):
        return Finding(name, "allowed by CAP_IPC_LOCK", "good")
    if limit is None:
        return Finding(name, "RLIMIT_MEMLOCK is hidden", "unknown")
    if limit == float("inf"):
        return Finding(name, "RLIMIT_MEMLOCK unlimited", "good")
    return Finding(
        name, f"RLIMIT_MEMLOCK {limit / 1024:.0f} KiB", "bad",
        "a page fault can delay a tick by milliseconds under memory pressure",
        "allow it and log in again; a systemd service has LimitMEMLOCK=infinity, a container needs --ulimit memlock=-1",
        f'echo "$USER - memlock unlimited" | sudo tee -a {LIMITS}',
    )  # fmt: skip
