"""Arrow IPC stream `recording.arrows`: the file of a running recording.

A stream is a schema message followed by one message per batch. All whole batches on disk are readable, however the
writer ended. Messages are written with plain write(2), unbuffered. A partly written message is truncated.

Source: Apache Arrow columnar format, "IPC Streaming Format".
"""

import contextlib
import fcntl
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from rtctl.config.errors import UserError
from rtctl.config.files import open_stream
from rtctl.trace import moved
from rtctl.trace.columns import Column, record_batch, schema

END_OF_STREAM = b"\xff\xff\xff\xff\x00\x00\x00\x00"
NOT_WHOLE = (StopIteration, pa.ArrowException, UnicodeDecodeError)  # Arrow's errors at the end and at damage


class StreamWriter:
    """Writer of batches of rows to an Arrow stream; `write` is unbuffered.

    An I/O error (disk full) raises OSError once. The file is truncated to its whole batches, and every later `write`
    returns 0. The open file is locked against a repair.
    """

    def __init__(
        self, path: Path, columns: Sequence[Column], dtype: np.dtype, metadata: Mapping[str, str] | None = None
    ):
        self.schema = schema(columns, dtype, metadata)
        self.rows = 0  # written
        self.bytes = 0  # written
        self.failed = False
        self._file = open_stream(path)
        try:
            lock(self._file, path)
            with contextlib.suppress(OSError):  # not a regular file
                os.ftruncate(self._file, 0)
            self._append(self.schema.serialize())
        except BaseException:
            self._shut()
            raise

    def write(self, rows: np.ndarray) -> int:
        """Append `rows` (structured array) as one batch; returns the number written: all, or 0 after a failure."""
        if self._file < 0:
            raise ValueError("the stream is closed")
        if self.failed or not len(rows):
            return 0
        self._append(record_batch(rows, self.schema).serialize())
        self.rows += len(rows)
        return len(rows)

    def is_at(self, path: Path) -> bool:
        """Whether `path` still names the file. True for a closed file."""
        return self._file < 0 or moved.in_place(self._file, path)

    def place(self) -> Path | None:
        """Present path of the file; None where it is deleted or closed."""
        return moved.place(self._file) if self._file >= 0 else None

    def move(self, path: Path) -> None:
        """Copy the file to `path` and continue there. Raises OSError and keeps the old file where this fails."""
        new = moved.copied(self._file, path)
        try:
            lock(new, path)
        except BaseException:
            os.close(new)
            raise
        self._shut()
        self._file = new

    def close(self) -> None:
        """End the stream and sync it to the disk. Raises OSError only if no earlier call did. May be called again."""
        if self._file < 0:
            return
        try:
            if not self.failed:
                self._append(END_OF_STREAM)
                os.fsync(self._file)
        finally:
            self._shut()

    def _append(self, message: "pa.Buffer | bytes") -> None:
        rest = memoryview(message)
        try:
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError:
            self.failed = True
            with contextlib.suppress(OSError):  # not a regular file; a reader stops at the broken message
                os.ftruncate(self._file, self.bytes)
            raise
        self.bytes += len(message)

    def _shut(self) -> None:
        file, self._file = self._file, -1
        if file >= 0:
            os.close(file)


class StreamReader:
    """Reader of the whole batches of a stream, possibly truncated, in order: `for batch in reader`.

    `schema` is None where the file ends before it. After the loop, `rows` and `bytes` count the whole part, end mark
    included. The loop raises UserError where the file is still being written.
    """

    def __init__(self, path: Path):
        self.path = Path(path)
        self.rows = 0
        self.bytes = 0
        self.schema: pa.Schema | None = None
        with pa.OSFile(str(path)) as file, contextlib.suppress(*NOT_WHOLE, OSError):
            schema = pa.ipc.open_stream(file).schema
            self.schema = schema if schema.names else None  # Arrow decodes names, and fails, only on access

    def __iter__(self) -> Iterator[pa.RecordBatch]:
        self.rows = self.bytes = 0
        if self.schema is None:
            return
        with self.path.open("rb") as guard, pa.OSFile(str(self.path)) as file:
            lock(guard.fileno(), self.path)
            stream = pa.ipc.open_stream(file)
            self.bytes = file.tell()
            while (batch := self._next(stream)) is not None:
                self.rows += batch.num_rows
                self.bytes = file.tell()
                yield batch
            guard.seek(self.bytes)
            if guard.read(len(END_OF_STREAM)) == END_OF_STREAM:
                self.bytes += len(END_OF_STREAM)

    @staticmethod
    def _next(stream: pa.RecordBatchReader) -> pa.RecordBatch | None:
        try:
            batch = stream.read_next_batch()
            batch.validate()  # a damaged message may declare more rows than it holds
            return batch
        except NOT_WHOLE:  # the end, or an incomplete message
            return None
        except OSError as error:
            if error.errno:  # error of the disk; Arrow's error for a short file has no errno
                raise
            return None


def lock(file: int, path: Path) -> None:
    """Lock an open file against other processes. The lock ends with its process."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise UserError(f"{path} is in use by another process; wait until that recording has ended") from None
