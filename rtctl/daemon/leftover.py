"""Shared-memory segment of a killed daemon: the rows of its ring, read with the description file beside it."""

import fcntl
import json
import mmap
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.daemon.shared_memory import ABOUT
from rtctl.machines.base import Column

ENDING = 10.0  # s to wait for the end of the loop of a killed supervisor


class Leftover(NamedTuple):
    path: Path  # of the segment
    rows: np.ndarray  # structured, (n,), oldest first
    columns: tuple[Column, ...]
    case: dict[str, Any]
    bundle: Path | None  # recording of the run


@contextmanager
def opened(path: Path) -> Iterator[Leftover]:
    """Rows of a segment, locked against other readers inside the context.

    Raises UserError where the segment cannot be read, where its loop still runs, or where another process reads it.
    """
    try:
        fd = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from None
    try:
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UserError(f"{path} is being recovered by another process; wait until that has ended") from None
        yield _read(path, fd)
    finally:
        os.close(fd)


def _read(path: Path, fd: int) -> Leftover:
    described = path.with_suffix(ABOUT)
    try:
        about = json.loads(described.read_text(encoding="utf-8"))
        memory = mmap.mmap(fd, 0, access=mmap.ACCESS_READ)
        names, kinds = zip(*about["fields"], strict=True)
        row = np.dtype({"names": names, "formats": kinds, "offsets": about["offsets"], "itemsize": about["itemsize"]})
        ring = np.frombuffer(memory, row, about["capacity"], about["rows"])
        _wait(path, memory, about["loop"])
        head = _number(memory, about["head"])
        # a killed loop may have overwritten part of the oldest row
        torn = head >= len(ring) and not _number(memory, about["loop"]["ended"])
        kept = np.arange(max(head - len(ring), 0) + torn, head) % len(ring)
        columns = tuple(Column(*column) for column in about["columns"])
        return Leftover(path, ring[kept], columns, dict(about["case"]), about["bundle"] and Path(about["bundle"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{described} does not describe {path.name}: {error}") from None


def _wait(path: Path, memory: mmap.mmap, loop: dict[str, int]) -> None:
    """Wait until the loop has ended: it writes its last rows after the supervisor has died."""
    deadline = time.monotonic() + ENDING
    while not _number(memory, loop["ended"]):
        pid = _number(memory, loop["pid"])
        try:
            orders = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            return
        if b"loop_process" not in orders:  # a zombie, or another process with this pid
            return
        if time.monotonic() > deadline:
            raise UserError(f"{path}: the loop of that daemon (pid {pid}) still runs; end it: kill {pid}")
        time.sleep(0.01)


def _number(memory: mmap.mmap, offset: int) -> int:
    return int(np.frombuffer(memory, np.int64, 1, offset)[0])
