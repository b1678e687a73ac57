"""MCAP file with messages of one length: a chunk and its index are written as one array each.

Header, schema, channel, attachment and summary are records of the package mcap. Its Writer takes one message a call,
which would cost more time than the rest of the export.

Source: MCAP specification (mcap.dev/spec): chunks, message indexes, summary.
"""

import struct
import zlib
from typing import IO, Any

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)  # fmt: skip

MAGIC = b"\x89MCAP0\r\n"
CHANNEL = SCHEMA = 1
LEVEL = 1  # of zstd: level 3 takes twice as long for 4 % less
HEAD = [
    ("opcode", "u1"),
    ("length", "<u8"),
    ("channel", "<u2"),
    ("sequence", "<u4"),
    ("log", "<u8"),
    ("publish", "<u8"),
]
INDEX = np.dtype([("log", "<u8"), ("offset", "<u8")])
INDEX_HEAD = struct.Struct("<BQHI")


class ChunkFile:
    """One topic. `message` is the record of one message; call `rows`, then `finish`."""

    def __init__(
        self, file: IO[bytes], library: str, topic: str, schema: tuple[str, str, bytes], message: np.dtype
    ) -> None:
        """schema: name, encoding and data; the messages have that encoding."""
        self._file, self._at = file, 0
        self._record = np.dtype([*HEAD, ("message", message)])
        self._packer = zstandard.ZstdCompressor(level=LEVEL)
        self._chunks: list[ChunkIndex] = []
        self._summary: dict[Opcode, list[Any]] = {}
        self._messages, self._start, self._end = 0, 0, 0
        name, encoding, data = schema
        self._told = [
            Schema(id=SCHEMA, data=data, encoding=encoding, name=name),
            Channel(id=CHANNEL, topic=topic, message_encoding=encoding, schema_id=SCHEMA, metadata={}),
        ]
        self._put(MAGIC)
        self._put(_bytes(Header("", library), *self._told))

    def records(self, count: int) -> np.ndarray:
        """Records (count,) of messages with known header fields; the caller fills `message`, `rows` the times."""
        rows = np.zeros(count, self._record)
        rows["opcode"], rows["channel"] = Opcode.MESSAGE, CHANNEL
        rows["length"] = self._record.itemsize - 9
        return rows

    def rows(self, rows: np.ndarray, at: np.ndarray) -> None:
        """Write a chunk of `records` whose log and publish times are `at`, (n,) uint64 ns."""
        n = len(rows)
        rows["log"] = rows["publish"] = at
        rows["sequence"] = (self._messages + np.arange(n)) & 0xFFFFFFFF
        start, end = int(at.min()), int(at.max())
        data = rows.view(np.uint8).data
        packed = self._packer.compress(data)
        chunk = Chunk(compression="zstd", data=packed, message_start_time=start, message_end_time=end,
                      uncompressed_crc=zlib.crc32(data), uncompressed_size=len(data))  # fmt: skip
        began = self._at
        self._put(_bytes(chunk))
        length = self._at - began
        index = np.empty(n, INDEX)
        index["log"], index["offset"] = at, np.arange(n) * self._record.itemsize
        beside = self._at
        self._put(INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + index.nbytes, CHANNEL, index.nbytes) + index.tobytes())
        self._chunks.append(ChunkIndex(
            chunk_start_offset=began, chunk_length=length, compression="zstd", compressed_size=len(packed),
            message_start_time=start, message_end_time=end, message_index_offsets={CHANNEL: beside},
            message_index_length=self._at - beside, uncompressed_size=len(data),
        ))  # fmt: skip
        self._start = min(self._start, start) if self._messages else start
        self._end, self._messages = max(self._end, end), self._messages + n

    def metadata(self, name: str, values: dict[str, str]) -> None:
        """Write a metadata record of names and texts."""
        data = _bytes(Metadata(name=name, metadata=values))
        index = MetadataIndex(offset=self._at, length=len(data), name=name)
        self._summary.setdefault(Opcode.METADATA_INDEX, []).append(index)
        self._put(data)

    def attachment(self, at: int, name: str, media_type: str, content: bytes) -> None:
        """Write an attachment with the time `at` in ns."""
        data = _bytes(Attachment(create_time=at, log_time=at, name=name, media_type=media_type, data=content))
        index = AttachmentIndex(offset=self._at, length=len(data), create_time=at, log_time=at,
                                data_size=len(content), name=name, media_type=media_type)  # fmt: skip
        self._summary.setdefault(Opcode.ATTACHMENT_INDEX, []).append(index)
        self._put(data)

    def finish(self) -> None:
        """Write the summary."""
        self._put(_bytes(DataEnd(0)))
        beside = {kind: len(found) for kind, found in self._summary.items()}
        told = Statistics(
            attachment_count=beside.get(Opcode.ATTACHMENT_INDEX, 0), channel_count=1,
            channel_message_counts={CHANNEL: self._messages}, chunk_count=len(self._chunks),
            message_count=self._messages, metadata_count=beside.get(Opcode.METADATA_INDEX, 0),
            message_start_time=self._start, message_end_time=self._end, schema_count=1,
        )  # fmt: skip
        schema, channel = self._told
        groups: dict[Opcode, list[Any]] = {
            Opcode.SCHEMA: [schema],
            Opcode.CHANNEL: [channel],
            Opcode.STATISTICS: [told],
            Opcode.CHUNK_INDEX: self._chunks,
            **self._summary,
        }
        began, summary, offsets = self._at, b"", []
        for opcode, found in groups.items():
            part = _bytes(*found)
            offsets.append(SummaryOffset(group_opcode=opcode, group_start=began + len(summary), group_length=len(part)))
            summary += part
        offset_start = began + len(summary)
        summary += _bytes(*offsets)
        crc = zlib.crc32(struct.pack("<BQQQ", Opcode.FOOTER, 20, began, offset_start), zlib.crc32(summary))
        self._put(summary + _bytes(Footer(began, offset_start, crc)) + MAGIC)

    def _put(self, data: bytes) -> None:
        self._file.write(data)
        self._at += len(data)


def _bytes(*records: Any) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())
