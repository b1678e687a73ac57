import os
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trace_rows import COLUMNS, ROW, is_truth, make

from rtctl.config.errors import UserError
from rtctl.trace.stream import StreamReader, StreamWriter


def fill(path: Path, sizes: list[int]) -> list[int]:
    """Write batches of the given sizes; returns the file length after each batch, bytes."""
    writer, ends = StreamWriter(path, COLUMNS, ROW, {"machine": "test"}), []
    for size in sizes:
        writer.write(make(writer.rows, size))
        ends.append(path.stat().st_size)
    writer.close()
    return ends


def test_other_programs_can_read_the_stream(tmp_path):
    fill(tmp_path / "a.arrows", [3, 1, 50])
    table = pa.ipc.open_stream((tmp_path / "a.arrows").read_bytes()).read_all()
    assert is_truth(table, range(54))
    assert table.schema.metadata == {b"machine": b"test"}


def test_every_batch_is_in_the_file_when_write_returns(tmp_path):
    path = tmp_path / "a.arrows"
    writer = StreamWriter(path, COLUMNS, ROW)
    for k in range(5):
        writer.write(make(10 * k, 10))
        assert path.stat().st_size == writer.bytes
        assert pa.ipc.open_stream(path.read_bytes()).read_all().num_rows == 10 * (k + 1)


@settings(deadline=None, max_examples=20)
@given(sizes=st.lists(st.integers(0, 40), max_size=8))
def test_written_rows_are_read_back(tmp_path_factory, sizes):
    path = tmp_path_factory.mktemp("s") / "a.arrows"
    fill(path, sizes)
    reader = StreamReader(path)
    table = pa.Table.from_batches(list(reader), reader.schema)
    assert reader.rows == sum(sizes) and is_truth(table, range(sum(sizes)))
    assert reader.bytes == path.stat().st_size


def test_full_disk_is_reported_once_and_written_rows_are_kept(tmp_path, small_disk):
    path = tmp_path / "a.arrows"
    writer = StreamWriter(path, COLUMNS, ROW)
    writer.write(make(0, 100))
    whole = path.stat().st_size
    with small_disk(whole + 500):
        with pytest.raises(OSError, match="File too large"):
            writer.write(make(100, 100))
        assert writer.write(make(200, 1)) == 0  # fits, but would follow a gap
        writer.close()
    assert path.stat().st_size == whole
    reader = StreamReader(path)
    assert is_truth(pa.Table.from_batches(list(reader)), range(100))
    assert (writer.rows, reader.rows, reader.bytes) == (100, 100, whole)


def test_close_reports_missing_space_for_the_end_mark_once(tmp_path, small_disk):
    path = tmp_path / "a.arrows"
    writer = StreamWriter(path, COLUMNS, ROW)
    writer.write(make(0, 10))
    with small_disk(path.stat().st_size), pytest.raises(OSError):
        writer.close()
    writer.close()
    assert sum(batch.num_rows for batch in StreamReader(path)) == 10


def test_device_without_space_is_refused_at_the_start():
    with pytest.raises(OSError, match="No space left"):
        StreamWriter(Path("/dev/full"), COLUMNS, ROW)


def test_closed_stream_accepts_no_rows(tmp_path):
    writer = StreamWriter(tmp_path / "a.arrows", COLUMNS, ROW)
    writer.close()
    with pytest.raises(ValueError, match="closed"):
        writer.write(make(0, 1))


def test_open_stream_is_locked_against_reading_and_overwriting(tmp_path):
    path = tmp_path / "a.arrows"
    writer = StreamWriter(path, COLUMNS, ROW)
    writer.write(make(0, 10))
    size = path.stat().st_size
    with pytest.raises(UserError, match="in use"):
        list(StreamReader(path))
    with pytest.raises(UserError, match="in use"):
        StreamWriter(path, COLUMNS, ROW)
    assert path.stat().st_size == size
    writer.close()
    assert len(list(StreamReader(path))) == 1


WRITE_FOR_EVER = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from trace_rows import COLUMNS, ROW, make
from rtctl.trace.stream import StreamWriter
writer = StreamWriter(Path(sys.argv[1]), COLUMNS, ROW)
for size in range(1, 1_000_000):
    writer.write(make(writer.rows, size % 97 + 1))
"""


@pytest.mark.parametrize("size", [1, 7_001, 400_009])
def test_killed_writer_leaves_a_prefix(tmp_path, size):
    path = tmp_path / "a.arrows"
    writer = subprocess.Popen([sys.executable, "-c", WRITE_FOR_EVER, path, Path(__file__).parent])
    try:
        while writer.poll() is None and not (path.exists() and path.stat().st_size >= size):
            os.sched_yield()
    finally:
        writer.kill()
        writer.wait()
    assert writer.returncode == -9
    reader = StreamReader(path)
    batches = list(reader)
    assert is_truth(pa.Table.from_batches(batches, reader.schema), range(reader.rows))
    assert reader.bytes <= path.stat().st_size < reader.bytes + 8_000  # less than one batch lost
