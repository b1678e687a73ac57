"""Captures: parts of the running trace, from now or from a trigger, each recorded as a separate bundle."""

from collections import deque
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.machines.base import Column
from rtctl.trace.capture import Capture
from rtctl.trace.recorder import Recorder
from rtctl.trace.trigger import Trigger

PRE_SECONDS = 10.0  # s of rows kept in memory for captures that begin before their trigger
MOST = 8  # captures at the same time


class Captures:
    """All captures of a run. `feed` gets every row, in order."""

    def __init__(self, rate: float, columns: tuple[Column, ...], dtype: np.dtype, case: dict[str, Any]):
        self._rate, self._columns, self._dtype, self._case = rate, columns, dtype, case
        self._running: dict[str, tuple[Capture, Recorder]] = {}
        self._done: dict[str, dict[str, Any]] = {}
        self._history: deque[np.ndarray] = deque()
        self._held = 0  # rows in _history
        self._number = 0

    def start(self, seconds: float, pre: float, trigger: str | None, out: str | None, name: str) -> dict[str, Any]:
        """Begin a capture. Raises UserError for a bad trigger, a folder that is taken, or too many at once."""
        if len(self._running) >= MOST:
            raise UserError(f"{MOST} captures are running; end one with `capture_stop`")
        if pre > PRE_SECONDS:
            raise UserError(f"pre is {pre:g} s; {PRE_SECONDS:g} s before the trigger is the most that is kept")
        names = [c.name for c in self._columns]
        if pre >= seconds:
            raise UserError(f"pre is {pre:g} s of {seconds:g} s; it must leave something after the trigger")
        capture = Capture(seconds - pre, pre, Trigger(trigger, names) if trigger else None, self._rate)
        self._number += 1
        stamp = datetime.now().strftime("%Y%m%d-%H%M%S")
        folder = Path(out) if out else Path("runs") / f"{name}-capture-{stamp}-{self._number}"
        try:
            recorder = Recorder(folder.absolute(), self._columns, self._dtype, self._case)
        except OSError as error:
            raise UserError(f"{folder}: cannot record here: {error.strerror}") from error
        identity = str(self._number)
        self._running[identity] = (capture, recorder)
        if self._history:
            capture.prime(np.concatenate(self._history)[-int(PRE_SECONDS * self._rate) :])
        return self.status(identity)

    def feed(self, rows: np.ndarray) -> None:
        """Rows for every capture that runs, and for the history before the next trigger."""
        for identity in list(self._running):
            self._take(identity, rows)
        self._history.append(rows)
        self._held += len(rows)
        while len(self._history) > 1 and self._held - len(self._history[0]) >= PRE_SECONDS * self._rate:
            self._held -= len(self._history.popleft())

    def note_lost(self, first: int, count: int) -> None:
        """Mark rows that the ring lost as missing in every running capture."""
        for _, recorder in self._running.values():
            recorder.note_lost(first, count)

    def status(self, identity: str) -> dict[str, Any]:
        """Progress of a capture and the folder of its bundle. Raises UserError for an unknown id."""
        if identity in self._done:
            return self._done[identity]
        if identity not in self._running:
            raise UserError(f"no capture '{identity}'; there is {', '.join([*self._running, *self._done]) or 'none'}")
        capture, recorder = self._running[identity]
        stats = recorder.stats()
        return {
            "id": identity,
            "done": False,
            "triggered": capture.trigger_tick is not None,
            "rows": stats.rows_written + stats.rows_queued,
            "bundle": str(recorder.folder),
        }

    def end(self, identity: str) -> dict[str, Any]:
        """End a capture now; its bundle holds the rows so far."""
        if identity in self._running:
            self._finish(identity)
        return self.status(identity)

    def close(self) -> None:
        """End all captures."""
        for identity in list(self._running):
            self._finish(identity)

    def _take(self, identity: str, rows: np.ndarray) -> None:
        capture, recorder = self._running[identity]
        wanted, done = capture.feed(rows)
        if len(wanted):
            recorder.put(wanted)
        if done:
            self._finish(identity)

    def _finish(self, identity: str) -> None:
        capture, recorder = self._running.pop(identity)
        entry: dict[str, Any] = {
            "id": identity,
            "done": True,
            "triggered": capture.trigger_tick is not None,
            "bundle": str(recorder.folder),
        }
        try:
            entry["bundle"] = str(recorder.finish())
            entry["rows"] = recorder.stats().rows_written
            if recorder.trouble:
                entry["error"] = recorder.trouble
        except OSError as error:
            entry["error"] = f"{recorder.folder}: {error}; recover the rows written so far with `rtctl trace repair`"
        self._done[identity] = entry
