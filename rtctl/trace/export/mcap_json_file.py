"""MCAP with JSON messages: one topic, named as the machine, a JSON message for each row.

Log time and publish time are the start of the recording plus `t`, to the nanosecond. A message holds `t` and every
other number with all digits. A value that was not measured is left out. Units are in the schema, and case.json is
attached. `mcap` (mcap_file.py) holds protobuf messages instead, which are written much faster.

Memory: one batch of rows as Python numbers.
"""

import json
from collections.abc import Iterator
from pathlib import Path

from mcap.writer import CompressionType, Writer

from rtctl import __version__
from rtctl.trace import json_rows
from rtctl.trace.bundle import CASE, as_json
from rtctl.trace.export.source import Source

UNITS = "rtctl.units"  # metadata record: unit of each column
SLICE = 4096  # rows converted to Python numbers at a time


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    epoch = source.epoch
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library=f"rtctl {__version__}")
        name = json_rows.schema_name(source.name)
        text = json.dumps(json_rows.schema(name, source.columns))
        schema = writer.register_schema(name, "jsonschema", text.encode())
        channel = writer.register_channel(json_rows.topic(source.name), "json", schema)
        units = {c.name: c.unit for c in source.columns if c.unit}
        writer.add_metadata(UNITS, units)
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
                yield row[0], json_rows.message(names, row).encode()
