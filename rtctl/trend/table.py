"""Table of a trend, in Parquet: one row a number or sensor of each piece. Known estimates are kept."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config import files
from rtctl.config.errors import UserError
from rtctl.trend.pieces import Piece

TABLE = "trend.parquet"
HELP = {
    "machine": "group of the case, name of the config, or the folder around the bundle",
    "folder": "bundle",
    "first_row": "first row of the piece in the recording",
    "at": "s since 1970 of the first row; null where the recording has no date",
    "begin_s": "s, clock of the first row",
    "seconds": "s, length of the piece",
    "kind": "parameter, or residual (rms that the fitted description leaves of a sensor, SI)",
    "name": "of the parameter, or of the sensor",
    "value": "estimate",
    "low": "90 % interval of the estimate",
    "high": "90 % interval of the estimate",
    "unit": "of value, low, high",
    "nominal": "the owner's value, or the least residual that the sensor can leave",
    "own": "whether the case says that the value differs between recordings",
    "told": "share of the owner's uncertainty that the piece takes away, 0 to 1",
    "error": "why the piece gives no estimate; null where it does",
    "stamp": "of what the estimate depends on",
}
TEXT = {"machine", "folder", "kind", "name", "unit", "error", "stamp"}


def _field(name: str, words: str) -> pa.Field:
    kind = {"first_row": pa.int64(), "own": pa.bool_()}.get(name, pa.string() if name in TEXT else pa.float64())
    return pa.field(name, kind, metadata={"help": words})


SCHEMA = pa.schema([_field(name, words) for name, words in HELP.items()])

Rows = list[dict[str, Any]]


def write(folder: Path, rows: Iterable[dict[str, Any]]) -> Path:
    """Write the table into the folder; its path. Raises UserError where the disk does not take it."""
    path = folder / TABLE
    plain = [{name: _plain(row.get(name)) for name in SCHEMA.names} for row in rows]
    try:
        with files.replaced(path, "wb", sync=True) as file:
            pq.write_table(pa.Table.from_pylist(plain, schema=SCHEMA), file, compression="zstd")
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from None
    return path


def _plain(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


def read(folder: Path) -> Rows:
    """Rows of an earlier trend; empty without one or with a damaged table, whose pieces are fitted again."""
    try:
        with pq.ParquetFile(folder / TABLE) as file:
            table = file.read()
    except (OSError, pa.ArrowException):
        return []
    return table.to_pylist() if table.schema.names == SCHEMA.names else []


def kept(folder: Path, pieces: Sequence[Piece]) -> dict[Piece, Rows]:
    """Rows of pieces from an earlier trend in the folder, for recordings that are unchanged."""
    by_stamp: dict[tuple[str, str], Rows] = {}
    for row in read(folder):
        by_stamp.setdefault((row["folder"], row["stamp"]), []).append(row)
    return {piece: rows for piece in pieces if (rows := by_stamp.get((piece.folder, piece.stamp)))}
