"""Parquet, from rtctl or from anywhere: units are in the metadata of each column where rtctl wrote it."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config.errors import UserError
from rtctl.trace.columns import columns_of
from rtctl.trace.imports.table import Table


def read(path: Path) -> Table:
    """The columns of a file; a time stamp is seconds from the first. Raises UserError, OSError."""
    try:
        table = pq.read_table(path)
    except pa.ArrowException as error:
        raise UserError(f"{path} cannot be read as Parquet: {str(error).splitlines()[0]}") from None
    columns = {name: _values(table.column(name)) for name in table.column_names}
    units = {c.name: c.unit for c in columns_of(table.schema) if c.unit}
    stamped = {n: "s" for n in table.column_names if pa.types.is_timestamp(table.schema.field(n).type)}
    return Table(path, columns, {**units, **stamped})


def _values(column: pa.ChunkedArray) -> np.ndarray:
    if pa.types.is_timestamp(column.type):
        stamps = column.to_numpy()
        return (stamps - stamps[0]) / np.timedelta64(1, "s") if len(stamps) else np.empty(0)
    if pa.types.is_null(column.type):
        return np.full(len(column), np.nan)
    return column.to_numpy()
