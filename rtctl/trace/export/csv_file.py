"""CSV by RFC 4180: a line of names with units, then a line for each row; commas, decimal points, CRLF.

A number has the digits that reproduce its bits. A value that was not measured is an empty cell.
Memory: one batch of rows.
"""

import csv
import io
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv

from rtctl.trace.columns import Column
from rtctl.trace.export.source import Source

PLAIN = pa_csv.WriteOptions(include_header=False)


def header(column: Column) -> str:
    """Title of a column: `ref [rad]`; only the name for a column without unit."""
    return f"{column.name} [{column.unit}]" if column.unit not in ("", "1") else column.name


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    with path.open("wb") as file:
        names = io.StringIO()
        csv.writer(names, lineterminator="\r\n").writerow([header(column) for column in source.columns])
        file.write(names.getvalue().encode())
        for batch in source.batches():
            lines = pa.BufferOutputStream()
            pa_csv.write_csv(pa.record_batch([_cells(c) for c in batch.columns], batch.schema.names), lines, PLAIN)
            file.write(lines.getvalue().to_pybytes().replace(b"\n", b"\r\n"))  # numbers only: no cell holds one


def _cells(column: pa.Array) -> pa.Array:
    if not pa.types.is_floating(column.type):
        return column.cast(pa.int8()) if pa.types.is_boolean(column.type) else column
    return pc.if_else(pc.is_nan(column), None, column)
