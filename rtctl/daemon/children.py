"""Child processes of the supervisor: start of the loop and the plant, and their reports."""

import contextlib
import json
import os
import subprocess
from collections import deque
from typing import Any

from rtctl.config.isolated import python


class ChildProcess:
    """One child process: its input pipe, its reports and its last error output. The child ends when the pipe closes."""

    def __init__(self, role: str, order: dict[str, Any]):
        self.role = role
        self.order = order
        self._partial = b""
        self._errors: deque[str] = deque(maxlen=20)
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.process = subprocess.Popen(
            python("-m", f"rtctl.daemon.{role}_process", json.dumps(order)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
        )
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            os.set_blocking(stream.fileno(), False)

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
