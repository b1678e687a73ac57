"""The file that is written while a recording runs: an Arrow IPC stream, `recording.arrows`.

A stream is a schema message followed by one message per batch, so that whatever whole batches are on disk can be read
back, however the writer ended. Messages are written here with plain write(2): nothing is buffered in the process, and
a write that fails half-way is cut off again.

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
NOT_WHOLE = (StopIteration, pa.ArrowException, UnicodeDecodeError)  # what Arrow raises at the end and at damage


class StreamWriter:
    """Appends batches of rows to an Arrow stream; every batch is with the operating system when `write` returns.

    An I/O error (disk full) is raised as OSError once, by the call that met it; the file is cut back to its whole
    batches, and every later `write` returns 0. The file is locked while it is open, so that a repair keeps off.
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
        """Append `rows` (structured array) as one batch. Returns the rows written: all, or 0 after a failure."""
        if self._file < 0:
            raise ValueError("the stream is closed")
        if self.failed or not len(rows):
            return 0
        self._append(record_batch(rows, self.schema).serialize())
        self.rows += len(rows)
        return len(rows)

    def is_at(self, path: Path) -> bool:
        """Whether `path` still names the file. True for one that is closed."""
        return self._file < 0 or moved.in_place(self._file, path)

    def place(self) -> Path | None:
        """Present path of the file; None where it was deleted, or is closed."""
        return moved.place(self._file) if self._file >= 0 else None

    def move(self, path: Path) -> None:
        """Copy what was written into a new file at `path` and go on there. Raises OSError; the old file stays then."""
        new = moved.copied(self._file, path)
        try:
            lock(new, path)
        except BaseException:
            os.close(new)
            raise
        self._shut()
        self._file = new

    def close(self) -> None:
        """End the stream and bring it to the disk. Raises OSError only if no earlier call did. May be called again."""
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
            with contextlib.suppress(OSError):  # not a regular file; a reader stops at the broken message anyway
                os.ftruncate(self._file, self.bytes)
            raise
        self.bytes += len(message)

    def _shut(self) -> None:
        file, self._file = self._file, -1
        if file >= 0:
            os.close(file)


class StreamReader:
    """The whole batches of a stream that may be cut off anywhere, in order: `for batch in reader`.

    `schema` is None where the file ends before it. After the loop `rows` and `bytes` say how much was whole, the end
    mark included. Raises UserError from the loop if the file is still being written.
    """

    def __init__(self, path: Path):
        self.path = Path(path)
        self.rows = 0
        self.bytes = 0
        self.schema: pa.Schema | None = None
        with pa.OSFile(str(path)) as file, contextlib.suppress(*NOT_WHOLE, OSError):
            schema = pa.ipc.open_stream(file).schema
            self.schema = schema if schema.names else None  # names that are no text are told only when asked for

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
            batch.validate()  # a damaged message may tell of more rows than it holds
            return batch
        except NOT_WHOLE:  # the end, or a message that is not whole
            return None
        except OSError as error:
            if error.errno:  # the disk's error, not Arrow's word for a file that is too short
                raise
            return None


def lock(file: int, path: Path) -> None:
    """Lock an open file against another process. The lock ends with the process that holds it, however that ends."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise UserError(f"{path} is in use by another process; wait until that recording has ended") from None
