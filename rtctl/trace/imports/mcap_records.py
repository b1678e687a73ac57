"""Records of an MCAP file in file order, up to its end or its first damage.

Chunks are unpacked up to the memory limit. The last chunk of a truncated file gives its whole messages.

Source: MCAP specification (mcap.dev/spec).
"""

import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, Any, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Message, Schema

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import limit, refuse_large

MAGIC = b"\x89MCAP0\r\n"
HEAD = 9  # bytes of opcode and length
CHUNK_HEAD = 28  # bytes of a chunk before the name of its compression


class Cut(NamedTuple):
    """Position where reading ended before the end of the data."""

    byte: int


def records(path: Path, file: IO[bytes]) -> Iterator[Schema | Channel | Message | Cut]:
    """Schemas, channels and messages in file order; a Cut comes last where the file is damaged. Raises UserError."""
    if file.read(len(MAGIC)) != MAGIC:
        raise UserError(f"{path} cannot be read as MCAP: it does not begin as one")
    end = path.stat().st_size
    unpacked = 0
    while True:
        at = file.tell()
        head = file.read(HEAD)
        if len(head) < HEAD:
            yield Cut(at)
            return
        opcode, length = struct.unpack("<BQ", head)
        if opcode in (Opcode.DATA_END, Opcode.FOOTER):
            return
        whole = length <= end - file.tell()
        if opcode == Opcode.CHUNK:
            size, inner = _chunk(path, file.read(min(length, end)), limit() - unpacked)
            unpacked += size
            yield from _parsed(inner)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE) and whole:
            yield from _parsed(head + file.read(length))
        elif whole:
            file.seek(length, 1)
        if not whole:
            yield Cut(at)
            return


def _parsed(data: bytes) -> Iterator[Schema | Channel | Message]:
    """Whole records of an unpacked chunk."""
    at = 0
    while at + HEAD <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        at += HEAD
        if length > len(data) - at:
            return
        record = _record(opcode, data[at : at + length])
        if record is not None:
            yield record
        at += length


def _record(opcode: int, data: bytes) -> Any:
    stream = ReadDataStream(BytesIO(data))
    if opcode == Opcode.SCHEMA:
        return Schema.read(stream)
    if opcode == Opcode.CHANNEL:
        return Channel.read(stream)
    return Message.read(stream, len(data)) if opcode == Opcode.MESSAGE else None


def _chunk(path: Path, data: bytes, left: int) -> tuple[int, bytes]:
    """Declared size of a chunk and its existing records; at most `left` bytes."""
    if len(data) < CHUNK_HEAD + 4:
        return 0, b""
    _, _, size, _, name = struct.unpack_from("<QQQII", data)
    compression = data[CHUNK_HEAD + 4 : CHUNK_HEAD + 4 + name].decode(errors="replace")
    packed = data[CHUNK_HEAD + 4 + name + 8 :]
    if size > left:
        refuse_large(path, limit() - left + size, "its chunks")
    if compression == "":
        return size, packed[:size]
    if compression == "zstd":
        import zstandard

        try:
            with zstandard.ZstdDecompressor(max_window_size=2**31).stream_reader(packed) as reader:
                return size, _all(reader, size)
        except zstandard.ZstdError:
            return size, b""
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        try:
            return size, LZ4FrameDecompressor().decompress(packed, max_length=size)
        except RuntimeError:
            return size, b""
    raise UserError(f"{path}: a chunk is packed with '{compression}'; zstd and lz4 can be read")


def _all(reader: Any, size: int) -> bytes:
    """Up to `size` bytes of a stream that may end early."""
    parts = []
    while size > 0 and (part := reader.read(min(size, 1 << 20))):
        parts.append(part)
        size -= len(part)
    return b"".join(parts)
