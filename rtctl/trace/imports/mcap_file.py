"""Reader of MCAP with JSON or protobuf messages. A column is `ref` with one topic, `/topic/ref` with several.

Where no field is the time, the column `log_time` is: log time in seconds from the first message. A truncated file gives
its whole messages.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Message, Schema

from rtctl.config.errors import UserError
from rtctl.trace.imports.mcap_records import Cut, records
from rtctl.trace.imports.messages import Messages
from rtctl.trace.imports.nested import notes_of, unit_text
from rtctl.trace.imports.protobuf_messages import ProtobufRows
from rtctl.trace.imports.table import Table
from rtctl.trace.protobuf_rows import ENCODING

TIME = "log_time"
DECODERS = {"cdr": "mcap-ros2-support", "ros1": "mcap-ros1-support"}


class _JsonRows(Messages):
    """JSON messages of one topic."""

    def __init__(self, path: Path, topic: str, schema: Schema | None) -> None:
        super().__init__(path, f"messages of {topic}")
        self._topic, self._schema = topic, schema.data if schema else b"{}"

    def add(self, message: bytes) -> None:
        try:
            super().add(json.loads(message))
        except (ValueError, RecursionError):
            raise UserError(
                f"{self.path}: message {self.rows + 1} of {self._topic} is no JSON: {message[:30]!r}"
            ) from None

    def units(self) -> dict[str, str]:
        return dict(_units(self._schema))


class _Topic:
    """Messages of one topic and their log times."""

    def __init__(self, path: Path, topic: str, encoding: str, schema: Schema | None) -> None:
        self.times: list[int] = []
        self.rows: _JsonRows | ProtobufRows
        if encoding == ENCODING and schema is not None:
            self.rows = ProtobufRows(path, topic, schema.name, schema.data)
        else:
            self.rows = _JsonRows(path, topic, schema)

    def add(self, message: Message) -> None:
        self.rows.add(message.data)
        self.times.append(message.log_time)


def _readable(channel: Channel, schema: Schema | None) -> bool:
    """Whether messages of a channel can be read: JSON, or protobuf with its descriptor."""
    described = schema is not None and schema.encoding == ENCODING
    return channel.message_encoding == "json" or (channel.message_encoding == ENCODING and described)


def read(path: Path) -> Table:
    """The columns of all topics in JSON or protobuf. Raises UserError, OSError."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    topics: dict[str, _Topic] = {}
    others: dict[int, int] = {}
    cut: Cut | None = None
    try:
        with path.open("rb") as file:
            for record in records(path, file):
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Cut):
                    cut = record
                elif record.channel_id in channels:
                    channel = channels[record.channel_id]
                    schema = schemas.get(channel.schema_id)
                    if not _readable(channel, schema):
                        others[channel.id] = others.get(channel.id, 0) + 1
                        continue
                    if channel.topic not in topics:
                        topics[channel.topic] = _Topic(path, channel.topic, channel.message_encoding, schema)
                    topics[channel.topic].add(record)
    except (OSError, UserError):
        raise
    except Exception:  # the reader raises any type for a damaged file
        raise UserError(f"{path} cannot be read as MCAP: it is damaged") from None
    left = {channels[k].topic: _other(channels[k], schemas, count) for k, count in others.items()}
    whole = sum(len(topic.times) for topic in topics.values())
    if not topics:
        raise UserError(_nothing(path, channels, others, left, cut))
    notes = [f"the file is cut off or damaged at byte {cut.byte}: {whole} messages are whole and taken"] if cut else []
    return _table(path, topics, notes, left)


def _table(path: Path, topics: dict[str, _Topic], notes: list[str], left: dict[str, str]) -> Table:
    columns: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    words: dict[str, str] = {}
    for name, topic in topics.items():
        before = "" if len(topics) == 1 else f"{name}/"
        found, gaps, texts = topic.rows.columns()
        known = topic.rows.units()
        notes += gaps
        words |= {before + key: why for key, why in texts.items()}
        times = np.array(topic.times, np.uint64)
        order = np.argsort(times, kind="stable")
        for key, values in found.items():
            columns[before + key] = values[order]
            if key in known:
                units[before + key] = known[key]
        columns[before + TIME] = (times[order] - times[order][0]).astype(np.int64) / 1e9
        units[before + TIME] = "s"
        stamps = [before + key for key, values in found.items() if values.dtype.kind == "m"]
        if stamps:
            notes.append(
                f"{', '.join(stamps)} is also a time, of the sender; take it as the clock with --map t={stamps[0]}"
            )
    return Table(
        path, columns, units, clock=TIME if len(topics) == 1 else "", where=lambda row: f"message {row + 1}",
        notes=(*notes, *notes_of(left)), left={**words, **left},
    )  # fmt: skip


def _other(channel: Channel, schemas: dict[int, Schema], count: int) -> str:
    """Number, encoding and schema of the messages of a channel, as text."""
    schema = schemas.get(channel.schema_id)
    named = f", schema {schema.name} ({schema.encoding or 'no encoding'})" if schema else ""
    return f"{count} messages in {channel.message_encoding or 'an unknown encoding'}{named}"


def _nothing(
    path: Path, channels: dict[int, Channel], others: dict[int, int], left: dict[str, str], cut: Cut | None
) -> str:
    cause = f"; it is cut off or damaged at byte {cut.byte}" if cut else ""
    if not left:
        return f"{path} has no whole message{cause}"
    told = "; ".join(f"{topic}: {what}" for topic, what in list(left.items())[:5])
    kinds = sorted({channels[k].message_encoding for k in others})
    tools = ", ".join(sorted({DECODERS[kind] for kind in kinds if kind in DECODERS}))
    way = f"decode them with {tools} (pip)" if tools else "decode them"
    return (f"{path} has no messages in JSON or protobuf, which can be read{cause}; it has {told}; {way} "
            "and write csv, parquet or JSON")  # fmt: skip


def _units(schema: bytes) -> list[tuple[str, str]]:
    """Unit of each property, as `rtctl trace export --to mcap-json` writes them; nested properties as `a.x`."""
    try:
        return _nested(json.loads(schema), "", 0)
    except (ValueError, RecursionError):
        return []


def _nested(schema: Any, before: str, depth: int) -> list[tuple[str, str]]:
    found = []
    properties = schema.get("properties") if isinstance(schema, Mapping) and depth < 16 else None
    for name, item in properties.items() if isinstance(properties, Mapping) else ():
        if not isinstance(item, Mapping):
            continue
        unit = item.get("unit") or item.get("units")
        if isinstance(unit, str):
            found.append((f"{before}{name}", unit_text(unit)))
        found += _nested(item, f"{before}{name}.", depth + 1)
    return found
