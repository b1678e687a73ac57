"""Child processes of the supervisor: start of the loop and the plant, their orders and their reports.

A child imports for half a second before it needs its orders. `early` starts children before the orders are known.
"""

import contextlib
import json
import os
import subprocess
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rtctl.config.isolated import python


class ChildProcess:
    """One child process: its input pipe, its reports and its last error output. The child ends when the pipe closes."""

    def __init__(self, role: str):
        self.role = role
        self.order: dict[str, Any] = {}
        self._partial = b""
        self._errors: deque[str] = deque(maxlen=20)
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            python("-m", f"rtctl.daemon.{role}_process"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
        )
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            os.set_blocking(stream.fileno(), False)

    def begin(self, order: dict[str, Any]) -> None:
        """Send the orders, as one line of JSON. A child that has died is noticed by `running`."""
        self.order = order
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(json.dumps(order).encode() + b"\n")
            self.process.stdin.flush()

    @property
    def pid(self) -> int:
        return self.process.pid

    def reports(self) -> list[dict[str, Any]]:
        """Reports of the child since the last call; never waits."""
        self._read_errors()
        assert self.process.stdout is not None
        data = self._partial + (_read(self.process.stdout.fileno()) or b"")
        lines = data.split(b"\n")
        self._partial = lines.pop()
        out = []
        for line in lines:
            try:
                out.append(json.loads(line))
            except ValueError:
                self._errors.append(line.decode(errors="replace"))
        return out

    def running(self) -> bool:
        return self.process.poll() is None

    def last_words(self) -> str:
        """Last 20 lines of the child's standard error, and of output that is no report."""
        self._read_errors()
        return "\n".join(self._errors)

    def stop(self, timeout: float = 5.0) -> None:
        """Close the child's pipe and wait at most `timeout` s for its end, then kill it."""
        if self.process.stdin is not None and not self.process.stdin.closed:
            with contextlib.suppress(OSError):
                self.process.stdin.close()
        try:
            self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _read_errors(self) -> None:
        assert self.process.stderr is not None
        data = _read(self.process.stderr.fileno())
        if data:
            self._errors.extend(data.decode(errors="replace").splitlines())


def _read(fd: int) -> bytes | None:
    try:
        return os.read(fd, 65536)
    except (BlockingIOError, ValueError):
        return None


_waiting: dict[str, ChildProcess] = {}  # children without orders, by role


@contextmanager
def early(*roles: str) -> Iterator[None]:
    """Start children of these roles now; `start_child` takes them. Those that wait at the end are ended."""
    _waiting.update({role: ChildProcess(role) for role in roles})
    try:
        yield
    finally:
        dismiss()


def start_child(role: str, order: dict[str, Any]) -> ChildProcess:
    """Child with these orders: the one that waits, or a new one."""
    child = _waiting.pop(role, None)
    if child is None or not child.running():
        child = ChildProcess(role)
    child.begin(order)
    return child


def dismiss() -> None:
    """End the children that still wait for orders."""
    while _waiting:
        _waiting.popitem()[1].stop(0.0)
