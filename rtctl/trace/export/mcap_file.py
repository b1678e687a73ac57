"""MCAP for Foxglove, PlotJuggler and Rerun: one topic, named as the machine, a protobuf message for each row.

Log time and publish time are the start of the recording plus `t`, to the nanosecond. A message holds `t` and every
other number to the bit. A value that was not measured is nan; an integer column with gaps becomes doubles. Units are
in the schema's comments and in the metadata `rtctl.units`; case.json is attached.

Memory: one batch of rows, and one chunk of messages.
"""

from pathlib import Path

import numpy as np

from rtctl import __version__
from rtctl.trace import json_rows, protobuf_rows
from rtctl.trace.bundle import CASE, as_json
from rtctl.trace.export.mcap_chunks import ChunkFile
from rtctl.trace.export.mcap_json_file import UNITS
from rtctl.trace.export.source import Source

ROWS = 16384  # messages in a chunk


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    epoch = source.epoch
    found = protobuf_rows.fields(source.columns, _dtypes(source))
    package, message = json_rows.PACKAGE, protobuf_rows.identifier(source.name)
    schema = (f"{package}.{message}", protobuf_rows.ENCODING, protobuf_rows.descriptor(package, message, found))
    with path.open("wb") as file:
        made = ChunkFile(file, f"rtctl {__version__}", json_rows.topic(source.name), schema, protobuf_rows.dtype(found))
        made.metadata(UNITS, {c.name: c.unit for c in source.columns if c.unit})
        made.attachment(epoch, CASE, "application/json", as_json(source.case, indent=1).encode())
        rows = made.records(ROWS)  # reused for each chunk with the same tags
        for n, field in enumerate(found):
            rows["message"][f"tag{n}"] = np.void(field.tag)
        for batch in source.batches():
            columns = [column.to_numpy(zero_copy_only=False) for column in batch.columns]
            for start in range(0, batch.num_rows, ROWS):
                part = [values[start : start + ROWS] for values in columns]
                chunk = rows[: len(part[0])]
                for n, values in enumerate(part):
                    chunk["message"][f"value{n}"] = values
                made.rows(chunk, np.uint64(epoch) + np.rint(part[0] * 1e9).astype(np.int64).view(np.uint64))
        made.finish()


def _dtypes(source: Source) -> list[np.dtype]:
    """dtype of each column in a message."""
    gaps = source.gaps
    kinds = [np.dtype(source.schema.field(column.name).type.to_pandas_dtype()) for column in source.columns]
    return [
        np.dtype(float) if column.name in gaps and kind.kind in "iub" else kind
        for column, kind in zip(source.columns, kinds, strict=True)
    ]
