"""Starting the loop and the plant as processes of their own, and reading what they report."""

import contextlib
import json
import os
import subprocess
from collections import deque
from typing import Any

from rtctl.config.isolated import python


class ChildProcess:
    """One child: its pipe (the end of which tells it that we are gone), its reports, and its last words."""

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
        """What it has reported since the last call; never waits."""
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
        """The end of what it wrote to standard error."""
        self._read_errors()
        return "\n".join(self._errors)

    def stop(self, timeout: float = 5.0) -> None:
        """Close its pipe and wait; what does not end by itself is killed."""
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
