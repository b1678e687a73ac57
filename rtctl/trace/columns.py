"""Arrow schema of recorded columns: name, unit and meaning, stored in the file."""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from rtctl.machines.base import Column

__all__ = ["Column", "columns_of", "record_batch", "schema"]


def schema(columns: Sequence[Column], dtype: np.dtype, metadata: Mapping[str, str] | None = None) -> pa.Schema:
    """The schema of a recording: one field for each of `columns`, typed as in `dtype`, unit and help in its metadata.

    Fields of `dtype` that are not among `columns` are not recorded. Raises ValueError where a column is missing in
    `dtype`, is named twice, or is not a scalar.
    """
    names = [column.name for column in columns]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"columns named twice: {', '.join(twice)}")
    fields = [_field(column, dtype) for column in columns]
    return pa.schema(fields, metadata=dict(metadata or {}))


def _field(column: Column, dtype: np.dtype) -> pa.Field:
    if column.name not in (dtype.names or ()):
        raise ValueError(f"column '{column.name}' is not in the row; it has {', '.join(dtype.names or ())}")
    kind = dtype[column.name]
    if kind.shape or kind.names:
        raise ValueError(f"column '{column.name}' is not a scalar but {kind}")
    return pa.field(
        column.name, pa.from_numpy_dtype(kind), nullable=False, metadata={"unit": column.unit, "help": column.help}
    )


def record_batch(rows: np.ndarray, schema: pa.Schema) -> pa.RecordBatch:
    """Record batch of rows (structured array). Copies."""
    return pa.record_batch([_array(rows[field.name], field.type) for field in schema], schema=schema)


def _array(values: np.ndarray, kind: pa.DataType) -> pa.Array:
    """Arrow array of values. `pa.array` would import an installed pandas: 0.5 s at the start of every recording."""
    values = np.ascontiguousarray(values)
    if pa.types.is_boolean(kind):  # Arrow packs eight booleans into a byte
        return pa.array(values)
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(values)])


def columns_of(schema: pa.Schema) -> list[Column]:
    """Columns of an Arrow schema; unit and help are empty where the file has none."""
    return [Column(field.name, _text(field, b"unit"), _text(field, b"help")) for field in schema]


def _text(field: pa.Field, key: bytes) -> str:
    return (field.metadata or {}).get(key, b"").decode(errors="replace")
