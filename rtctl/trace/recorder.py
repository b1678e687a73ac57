"""Recorder of rows, which never blocks the supervisor.

A thread writes the stream from a bounded queue. Rows are lost where the queue is full or the disk has failed. The
bundle holds number and ticks of the lost rows: rows put = rows written + rows queued + rows lost.

Memory is constant: the queue and the list of gaps are bounded.
"""

import contextlib
import itertools
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.trace.bundle import ARROWS, CASE, FORMAT
from rtctl.trace.columns import Column
from rtctl.trace.losses import Losses
from rtctl.trace.orders import ORDERS
from rtctl.trace.part import Part
from rtctl.trace.rotation import Parts, Rotation

ENOUGH = 1 << 20  # bytes in the queue that are written without waiting for more
LOOK = 0.5  # s between two checks that the folder still has its path


class RecorderStats(NamedTuple):
    rows_written: int
    rows_queued: int
    rows_lost: int
    bytes_written: int
    bytes_queued: int
    gaps: list[list[int]]  # [first tick, count]
    error: str | None  # write failure, or move or deletion of the folder; None without


class Recorder:
    """Recorder into `folder`, which must not hold a recording yet. The case is on disk before the first row.

    `max_queued_bytes` bounds the queue. `batch` is the longest wait of a row for its batch in s: it makes the stream
    smaller at low rates, and a crash loses the rows of this time. `rotation` splits the recording into parts. Raises
    UserError where the folder is taken, OSError where it is not writable.
    """

    def __init__(
        self,
        folder: Path,
        columns: Sequence[Column],
        dtype: np.dtype,
        case: Mapping[str, Any],
        max_queued_bytes: int = 64 << 20,
        batch: float = 0.0,
        rotation: Rotation | None = None,
    ):
        self.folder = Path(folder)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        self.case = {"format": FORMAT, "recorded_at": now, **case}
        self._losses = Losses()
        self._changed = threading.Condition()  # guards the fields below; never held during I/O
        self._bundle: Part | Parts
        if rotation is None or rotation == Rotation():
            self._bundle = Part(self.folder, columns, dtype, self.case)
        else:
            self._bundle = Parts(self.folder, columns, dtype, self.case, rotation, self._lost)
        self._most = max_queued_bytes
        self._batch = batch
        self._queue: deque[np.ndarray] = deque()
        self._queued = 0  # bytes
        self._written = 0  # rows
        self._error: Exception | None = None
        self._moves: list[str] = []  # sentences: the folder was renamed or deleted
        self._looked = time.monotonic()
        self._closing = False
        self._finished: Path | None = None
        self._thread = threading.Thread(target=self._write_queue, name="recorder", daemon=True)
        self._thread.start()

    def put(self, rows: np.ndarray) -> int:
        """Queue rows (structured array, owned by the recorder from now on), in order; returns the number of lost rows.

        Never blocks on the disk. Where the queue is full, the last rows are lost.
        """
        with self._changed:
            if self._closing:
                raise RuntimeError("the recorder is finished")
            room = 0 if self._error else max(0, self._most - self._queued) // rows.dtype.itemsize
            taken = rows if len(rows) <= room else rows[:room].copy()  # a view would keep all rows in memory
            if len(taken):
                self._queue.append(taken)
                self._queued += taken.nbytes
                self._changed.notify_all()
            self._losses.add_ticks(rows["tick"][len(taken) :])
            return len(rows) - len(taken)

    def note_lost(self, first_tick: int, count: int) -> None:
        """Count rows lost before `put`, by an overflow of the ring."""
        with self._changed:
            self._losses.add(first_tick, count)

    @property
    def trouble(self) -> str | None:
        """Sentence about a write failure or a moved or deleted folder; None without either."""
        return "; ".join([*([str(self._error)] if self._error else []), *self._moves]) or None

    def stats(self) -> RecorderStats:
        with self._changed:
            return RecorderStats(
                rows_written=self._written,
                rows_queued=sum(map(len, self._queue)),
                rows_lost=self._losses.rows,
                bytes_written=self._bundle.bytes,
                bytes_queued=self._queued,
                gaps=self._losses.gaps,
                error=self.trouble,
            )

    def finish(self, extra: Mapping[str, Any] | None = None) -> Path:
        """Write the queue and finish the bundle; returns its folder. `extra` goes into the case. May be called again.

        Raises OSError where the Parquet file cannot be written. The stream then stays, for `repair`.
        """
        if self._finished:
            return self._finished
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        self._look()  # where it raises, the part stays open for another call
        try:
            self._bundle.close()
        except OSError as error:
            self._error = self._error or error
        moves = {"recording_moved": self._moves} if self._moves else {}
        self._bundle.finish({**(extra or {}), **moves}, self._losses, self._error)
        self._finished = self.folder
        return self.folder

    def abandon(self) -> None:
        """Remove the folder where no row came, for the next attempt; else leave it as it is."""
        if self._finished or not isinstance(self._bundle, Part):
            return
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        with contextlib.suppress(OSError):
            self._bundle.close()
            if self._bundle.rows == 0 and not self._losses.rows:
                for name in (ARROWS, CASE, ORDERS):
                    (self.folder / name).unlink(missing_ok=True)
                self.folder.rmdir()  # fails, as it should, where the folder holds other files

    def _look(self) -> None:
        """Follow the folder where it was renamed or deleted. Raises OSError where its rows cannot be rescued."""
        self._looked = time.monotonic()
        if told := self._bundle.look():
            self.folder = self._bundle.folder
            self._moves.append(told)

    def _lost(self, first_tick: int, end: int) -> Losses:
        with self._changed:
            return self._losses.between(first_tick, end)

    def _write_queue(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._queue or self._closing)
                if self._batch:
                    self._changed.wait_for(lambda: self._closing or self._queued >= ENOUGH, self._batch)
                if not self._queue:
                    return
                batch = self._next_batch()
            rows = batch[0] if len(batch) == 1 else np.concatenate(batch)
            error: Exception | None = None
            try:
                if time.monotonic() - self._looked >= LOOK:
                    self._look()
                self._bundle.write(rows)
            except Exception as failure:  # mostly a full disk; the rows must be counted for any error
                error = failure
            with self._changed:
                for _ in batch:
                    self._queue.popleft()
                self._queued -= rows.nbytes
                taken = self._bundle.rows - self._written
                self._written += taken
                if error is not None:
                    self._give_up(error, rows[taken:])

    def _next_batch(self) -> list[np.ndarray]:
        """Next batch to write; its rows stay in the queue, and in its count, until written."""
        batch = [self._queue[0]]
        size = batch[0].nbytes
        for rows in itertools.islice(self._queue, 1, None) if self._batch else ():
            size += rows.nbytes
            if size > ENOUGH:
                break
            batch.append(rows)
        return batch

    def _give_up(self, error: Exception, rest: np.ndarray) -> None:
        self._error = error
        for rows in (rest, *self._queue):
            self._losses.add_ticks(rows["tick"])
        self._queue.clear()
        self._queued = 0
