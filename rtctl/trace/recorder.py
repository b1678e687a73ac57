"""The recorder: takes rows from the supervisor and never makes it wait.

A thread writes the stream; a bounded queue stands in front of it. Rows that find the queue full, or a disk that has
failed, are lost, and the bundle says how many and which: rows put = rows written + rows queued + rows lost.
"""

import threading
from collections import deque
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.trace.bundle import ARROWS, FORMAT, PARQUET, as_json, save_case, write_parquet
from rtctl.trace.columns import Column
from rtctl.trace.losses import Losses
from rtctl.trace.stream import StreamReader, StreamWriter


class RecorderStats(NamedTuple):
    rows_written: int
    rows_queued: int
    rows_lost: int
    bytes_written: int
    bytes_queued: int
    gaps: list[list[int]]  # [first tick, count]
    error: str | None  # what stopped the writing, if anything did


class Recorder:
    """Records into `folder`, which must not hold a recording yet. The case is on disk before the first row.

    `max_queued_bytes` bounds the memory that a slow disk may take. Raises UserError where the folder is taken, OSError
    where it cannot be written to.
    """

    def __init__(
        self,
        folder: Path,
        columns: Sequence[Column],
        dtype: np.dtype,
        case: Mapping[str, Any],
        max_queued_bytes: int = 64 << 20,
    ):
        self.folder = Path(folder)
        self._refuse_a_taken_folder()
        self.folder.mkdir(parents=True, exist_ok=True)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        self.case = {"format": FORMAT, "recorded_at": now, **case}
        save_case(self.folder, {**self.case, "complete": False})
        self._writer = StreamWriter(self.folder / ARROWS, columns, dtype, {"case": as_json(self.case)})
        self._most = max_queued_bytes
        self._queue: deque[np.ndarray] = deque()
        self._queued = 0  # bytes
        self._written = 0  # rows
        self._losses = Losses()
        self._error: Exception | None = None
        self._closing = False
        self._finished: Path | None = None
        self._changed = threading.Condition()  # guards all of the above; never held during I/O
        self._thread = threading.Thread(target=self._write_queue, name="recorder", daemon=True)
        self._thread.start()

    def put(self, rows: np.ndarray) -> int:
        """Hand over rows (structured array, the recorder's from now on), in order. Returns how many were lost at once.

        Never blocks on the disk. What does not fit into the queue is lost from its end.
        """
        with self._changed:
            if self._closing:
                raise RuntimeError("the recorder is finished")
            room = 0 if self._error else max(0, self._most - self._queued) // rows.dtype.itemsize
            taken = rows if len(rows) <= room else rows[:room].copy()  # a view would keep all of the rows in memory
            if len(taken):
                self._queue.append(taken)
                self._queued += taken.nbytes
                self._changed.notify_all()
            self._losses.add_ticks(rows["tick"][len(taken) :])
            return len(rows) - len(taken)

    def note_lost(self, first_tick: int, count: int) -> None:
        """Rows that never came this far: the ring overflowed before it was drained."""
        with self._changed:
            self._losses.add(first_tick, count)

    def stats(self) -> RecorderStats:
        with self._changed:
            return RecorderStats(
                rows_written=self._written,
                rows_queued=sum(map(len, self._queue)),
                rows_lost=self._losses.rows,
                bytes_written=self._writer.bytes,
                bytes_queued=self._queued,
                gaps=self._losses.gaps,
                error=str(self._error) if self._error else None,
            )

    def finish(self, extra: Mapping[str, Any] | None = None) -> Path:
        """Write what is queued, make the bundle and return its folder; `extra` goes into the case. May be called again.

        Raises OSError where the disk does not take the Parquet file; the stream then stays, for `repair`.
        """
        if self._finished:
            return self._finished
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join()
        try:
            self._writer.close()
        except OSError as error:
            self._error = self._error or error
        reader = StreamReader(self.folder / ARROWS)
        case = {**self.case, **(extra or {}), "rows": self._writer.rows, "losses": self._losses.as_dict()}
        case["complete"] = not self._losses.rows and not self._error
        if self._error:
            case["recording_error"] = str(self._error)
        try:
            write_parquet(self.folder, reader, self._writer.schema, expect=self._writer.rows)
        except OSError:
            save_case(self.folder, {**case, "complete": False})  # the losses are known only here
            raise
        save_case(self.folder, case)
        reader.path.unlink()  # last: until now everything can be made from it
        self._finished = self.folder
        return self.folder

    def _write_queue(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._queue or self._closing)
                if not self._queue:
                    return
                rows = self._queue[0]  # stays queued, and counted, until it is written
            try:
                self._writer.write(rows)
            except Exception as error:  # a full disk, mostly; whatever it is, the rows must be counted
                self._give_up(error)
                continue
            with self._changed:
                self._queue.popleft()
                self._queued -= rows.nbytes
                self._written += len(rows)

    def _give_up(self, error: Exception) -> None:
        with self._changed:
            self._error = error
            for rows in self._queue:
                self._losses.add_ticks(rows["tick"])
            self._queue.clear()
            self._queued = 0

    def _refuse_a_taken_folder(self) -> None:
        for name in (ARROWS, PARQUET):
            if (self.folder / name).exists():
                raise UserError(f"{self.folder} already holds {name}; choose another folder")
