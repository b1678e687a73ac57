"""Parquet file of the selected rows and columns; the metadata of each column holds its unit and help.

Memory: one row group.
"""

from pathlib import Path

import pyarrow.parquet as pq

from rtctl.trace.bundle import ROW_GROUP, as_json
from rtctl.trace.export.source import Source


def write(source: Source, path: Path) -> None:
    """Write the rows of `source` to `path`. Raises OSError."""
    schema = source.schema.with_metadata({"case": as_json(source.case)})
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for batch in source.batches():
            writer.write_batch(batch, row_group_size=ROW_GROUP)
