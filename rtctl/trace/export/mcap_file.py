"""MCAP, which Foxglove and PlotJuggler open: one topic, named as the machine, a JSON message for each row.

Log time and publish time are one: when the recording began, plus `t`, to the nanosecond. `t` itself and every other
number are in the message with all their digits; what was not measured is left out of it. Units are in the schema, and
case.json is attached.

Memory: one batch of rows as Python's numbers.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from rtctl import __version__
from rtctl.trace.bundle import CASE, as_json
from rtctl.trace.columns import Column
from rtctl.trace.export.source import Source

SLICE = 4096  # rows that are Python's numbers at a time


def topic(source: Source) -> str:
    """/ivu, so that a curve is /ivu/ref in PlotJuggler and /ivu.ref in Foxglove."""
    return f"/{source.name}"


def json_schema(name: str, columns: list[Column]) -> dict[str, Any]:
    """JSON Schema of a message; `unit` beside the type is for people and for programs that want it."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        "type": "object",
        "properties": {c.name: {"type": "number", "description": _words(c), "unit": c.unit} for c in columns},
    }


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    began = source.started
    epoch = int(began.timestamp() // 1) * 1_000_000_000 + began.microsecond * 1000 if began else 0
    epoch = max(epoch, math.ceil(-source.span[0]) * 1_000_000_000)  # MCAP has no time before its zero
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library=f"rtctl {__version__}")
        name = f"rtctl.{source.name}"
        schema = writer.register_schema(name, "jsonschema", json.dumps(json_schema(name, source.columns)).encode())
        channel = writer.register_channel(topic(source), "json", schema)
        units = {c.name: c.unit for c in source.columns if c.unit}
        writer.add_metadata("rtctl.units", units)
        writer.add_attachment(epoch, epoch, CASE, "application/json", as_json(source.case, indent=1).encode())
        for number, (t, message) in enumerate(_messages(source)):
            at = epoch + round(t * 1e9)
            writer.add_message(channel, at, message, at, number & 0xFFFFFFFF)
        writer.finish()


def _messages(source: Source) -> Iterator[tuple[float, bytes]]:
    """(t, message) of each row."""
    for batch in source.batches():
        names = batch.schema.names
        for start in range(0, batch.num_rows, SLICE):
            columns = [column.slice(start, SLICE).to_numpy(zero_copy_only=False).tolist() for column in batch.columns]
            for row in zip(*columns, strict=True):
                yield row[0], _message(names, row).encode()


def _message(names: list[str], row: tuple[Any, ...]) -> str:
    try:
        return json.dumps(dict(zip(names, row, strict=True)), allow_nan=False)
    except ValueError:
        return json.dumps({name: value for name, value in zip(names, row, strict=True) if math.isfinite(value)})


def _words(column: Column) -> str:
    unit = f"[{column.unit}]" if column.unit else ""
    return f"{column.help} {unit}".strip()
