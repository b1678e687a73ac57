"""Reader of Parquet and Arrow files. Units are in the metadata of each column: `unit` or `units`.

A field of a struct is `a.x`, an element of a list `a.1` where all lists are of one length. Dates and durations keep
their type.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from rtctl.config.errors import UserError
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.nested import notes_of, unit_text
from rtctl.trace.imports.table import Table

ARROW = b"ARROW1"


class Part(NamedTuple):
    """Column of numbers, or the reason why it became no column."""

    name: str
    values: np.ndarray | None
    why: str = ""


def read(path: Path) -> Table:
    """The columns of a file. Raises UserError, OSError."""
    with path.open("rb") as file:
        arrow = file.read(len(ARROW)) == ARROW
    try:
        table = _arrow(path) if arrow else _parquet(path)
        columns, units, left = {}, {}, {}
        for field, column in zip(table.schema, table.columns, strict=True):
            unit = _unit(field)
            for part in _parts(field.name, pa.chunked_array(column.chunks, field.type)):
                if part.name in columns:
                    raise UserError(f"{path}: two columns are called '{part.name}'; give each a name of its own")
                if part.values is None:
                    left[part.name] = part.why
                    continue
                columns[part.name] = part.values
                if unit is not None and part.values.dtype.kind not in "Mm":
                    units[part.name] = unit
    except (pa.ArrowException, ValueError, EOFError) as error:
        if isinstance(error, OSError):
            raise
        kind = "Arrow" if arrow else "Parquet"
        raise UserError(f"{path} cannot be read as {kind}: it is damaged, cut off or of another kind") from None
    return Table(path, columns, units, notes=notes_of(left), left=left)


def _parquet(path: Path) -> pa.Table:
    file = pq.ParquetFile(path)
    meta = file.metadata
    size = 0
    for group in (meta.row_group(k) for k in range(meta.num_row_groups)):
        for chunk in (group.column(k) for k in range(group.num_columns)):
            width = chunk.type_length if hasattr(chunk, "type_length") else 8
            size += max(chunk.num_values * (width or 8), group.num_rows * 8, chunk.total_uncompressed_size)
    refuse_large(path, size)
    return file.read()


def _arrow(path: Path) -> pa.Table:
    with pa.memory_map(str(path)) as source:
        reader = pa.ipc.open_file(source)
        batches, size = [], 0
        for k in range(reader.num_record_batches):
            batches.append(reader.get_batch(k))
            size += batches[-1].nbytes
            refuse_large(path, size)
        return pa.Table.from_batches(batches, reader.schema)


def _unit(field: pa.Field) -> str | None:
    """Unit in the metadata of a column; None where there is none or an empty one."""
    given = field.metadata or {}
    for key in (b"unit", b"units", b"Unit", b"Units"):
        if given.get(key):
            return unit_text(given[key].decode(errors="replace"))
    return None


def _parts(name: str, column: pa.ChunkedArray) -> Iterator[Part]:
    """Columns (n,) of one column of the file."""
    kind = column.type
    if isinstance(kind, pa.BaseExtensionType):
        yield from _parts(name, pa.chunked_array([c.storage for c in column.chunks], kind.storage_type))
    elif pa.types.is_dictionary(kind):
        yield from _parts(name, pa.chunked_array([c.dictionary_decode() for c in column.chunks], kind.value_type))
    elif pa.types.is_run_end_encoded(kind):
        yield from _parts(name, pa.chunked_array([pc.run_end_decode(c) for c in column.chunks], kind.value_type))
    elif pa.types.is_struct(kind):
        for k in range(kind.num_fields):
            field = kind.field(k)
            chunks = [pc.struct_field(chunk, [k]) for chunk in column.chunks]  # a null struct makes its fields null
            yield from _parts(f"{name}.{field.name}", pa.chunked_array(chunks, field.type))
    elif pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
        yield from _listed(name, column)
    else:
        yield _plain(name, column)


def _listed(name: str, column: pa.ChunkedArray) -> Iterator[Part]:
    lengths = pc.list_value_length(column.combine_chunks() if column.num_chunks != 1 else column.chunk(0))
    if lengths.null_count:
        yield Part(name, None, f"{lengths.null_count} of its lists are missing")
        return
    found = pc.min_max(lengths).as_py() if len(lengths) else {"min": 0, "max": 0}
    if found["min"] != found["max"]:
        yield Part(name, None, f"lists of {found['min']} to {found['max']} elements; write one column for each element")
        return
    for k in range(found["max"]):
        chunks = [pc.list_element(chunk, k) for chunk in column.chunks]
        yield from _parts(f"{name}.{k + 1}", pa.chunked_array(chunks, column.type.value_type))


def _plain(name: str, column: pa.ChunkedArray) -> Part:
    kind = column.type
    if pa.types.is_null(kind):
        return Part(name, np.full(len(column), np.nan))
    if pa.types.is_decimal(kind):
        return Part(name, column.cast(pa.float64()).to_numpy())
    if pa.types.is_time(kind):
        unit = kind.unit
        whole = column.cast(pa.int32() if pa.types.is_time32(kind) else pa.int64()).cast(pa.int64())
        return Part(name, whole.cast(pa.duration(unit)).to_numpy())
    if pa.types.is_date(kind) or pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        return Part(name, column.to_numpy())
    if pa.types.is_boolean(kind) or pa.types.is_integer(kind) or pa.types.is_floating(kind):
        if column.null_count:
            column = column.cast(pa.float64(), safe=False)
        return Part(name, column.to_numpy())
    if pa.types.is_string(kind) or pa.types.is_large_string(kind) or str(kind) == "string_view":
        return Part(name, column.to_numpy())
    return Part(name, None, f"values of type {kind}")
