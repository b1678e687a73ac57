"""A machine inside the test process that answers the command socket like a daemon and moves on request."""

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import zmq

from rtctl.config.bounds import Bounds
from rtctl.daemon.answers import Answers
from rtctl.daemon.commands import Commands
from rtctl.daemon.server import CommandServer
from rtctl.daemon.watched import Watched


class Served(Answers):
    """Supervisor around a Bench, as seen by commands and viewers: real commands and refusals, no clock."""

    def __init__(self, bench: Any, endpoint: str):
        self.bench, self.endpoint = bench, endpoint
        self.machine, self.made, self.segment = bench.machine, bench.made, bench.segment
        self.bounds = Bounds(bench.machine.config)
        self.config, self.link = bench.machine.config, "shm"
        self.status, self.mailbox, self.reader = bench.status, bench.mailbox, bench.reader
        self.lacks: list[str] = []
        self.faults = SimpleNamespace(told=[])
        self.watched = Watched()
        self.recorder: Any = None
        self.last_row: Any = None
        self.changes: list[tuple[str, Any]] = []
        self._context = zmq.Context()
        self._thread: threading.Thread | None = None
        self.start()

    def order(self, write: Any, changed: dict[str, Any] | None = None) -> None:
        self.mailbox.post(write)

    def note_change(self, path: str, value: Any) -> None:
        self.changes.append((path, value))

    def run(self, seconds: float) -> np.ndarray:
        """The rows of the next `seconds` of virtual time."""
        rows = self.bench.run(seconds)
        self.last_row = rows[-1]
        return rows

    def start(self) -> None:
        """Listen, like a started daemon."""
        self.server = CommandServer(self.endpoint, Commands(self), self._context)  # type: ignore[arg-type]
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def stop(self) -> None:
        """Stop listening, like an ended daemon."""
        if self._thread is not None:
            self._done.set()
            self._thread.join()
            self._thread = None
            self.server.close()

    def close(self) -> None:
        self.stop()
        self._context.destroy(linger=0)

    def _answer(self) -> None:
        while not self._done.is_set():
            if self.server.socket.poll(5):
                self.server.process()
