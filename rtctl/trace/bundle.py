"""Bundle of a recording: a folder with `recording.parquet` (rows) and `case.json` (settings, nominal model).

While a recording runs, the folder holds `recording.arrows`, which `finish` converts to `recording.parquet`.
At every moment of the conversion, `rtctl.trace.repair` can rebuild the bundle from the folder.

A long recording has parts, the bundles `part-0001`, `part-0002` and so on. `case.json` beside them describes all parts.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config import files
from rtctl.config.errors import UserError, nearest
from rtctl.trace import notebook
from rtctl.trace.columns import columns_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ARROWS = "recording.arrows"
PARQUET = "recording.parquet"
CASE = "case.json"
PART = "part-{:04d}"
FORMAT = 1  # of case.json of a machine that rtctl knows by name
FORMATS = (FORMAT, 2)
ROW_GROUP = 65_536  # rows that a conversion holds in memory


@dataclass(frozen=True, eq=False, repr=False)
class Bundle:
    """Loaded recording: `bundle["capstan"]` is a column (n,)."""

    columns: dict[str, np.ndarray]
    case: dict[str, Any]
    folder: Path
    units: dict[str, str]  # column -> unit, of columns that have a unit

    def __getitem__(self, name: str) -> np.ndarray:
        """Column (n,) by its name. Raises UserError where no column has this name."""
        return notebook.column(self, name)

    def __iter__(self) -> Iterator[str]:
        """Names of the columns."""
        return iter(self.columns)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.columns["t"])

    def __repr__(self) -> str:
        return notebook.words(self)

    def _repr_html_(self) -> str:
        return notebook.html(self)

    def __arrow_c_stream__(self, requested_schema: Any = None) -> Any:
        """Arrow stream of the columns, for `polars.from_arrow`, `duckdb`, `pyarrow.table` and others."""
        return notebook.arrow(self).__arrow_c_stream__(requested_schema)

    def to_pandas(self) -> Any:
        """DataFrame indexed by time in s; units in its `attrs`. Raises UserError without pandas."""
        return notebook.to_pandas(self)

    def to_xarray(self) -> Any:
        """Dataset along `t` in s, with units. Raises UserError without xarray."""
        return notebook.to_xarray(self)

    def plot(self, *columns: str) -> "Figure":
        """Figure of `columns` over time; of all known columns by default. Raises UserError for a missing column."""
        return notebook.plot(self, columns)


def load_bundle(folder: Path | str) -> Bundle:
    """Load a finished bundle, all parts as one. Raises UserError that names the file and the remedy."""
    folder = Path(folder)
    if not folder.is_dir():
        raise no_folder(folder)
    paths = recordings(folder)
    case = load_case(folder)
    path = paths[0]
    table = _table(paths)
    return Bundle(columns_of_table(path, table), case, folder, units_of(table.schema))


def columns_of_table(path: Path, table: pa.Table) -> dict[str, np.ndarray]:
    """Columns (n,) by name of a table read from `path`. Raises UserError where the table is no recording."""
    columns = {name: _numbers(path, name, table.column(name)) for name in table.column_names}
    if "t" not in columns:
        hint = nearest("t", columns) or nearest("time", columns)
        raise UserError(f"{path} has no column 't' (s, clock at the tick)" + (f"; is it '{hint}'?" if hint else ""))
    if not len(columns["t"]):
        raise UserError(f"{path} holds no rows")
    if not np.isfinite(columns["t"]).all():
        raise UserError(f"{path}: column 't' is not finite in row {int(np.argmin(np.isfinite(columns['t'])))}")
    return columns


def units_of(schema: pa.Schema) -> dict[str, str]:
    """Units by column, of the columns that have a unit."""
    return {c.name: c.unit for c in columns_of(schema) if c.unit}


def part_folders(folder: Path) -> list[Path]:
    """Part folders of a long recording, in order; empty for a recording without parts."""
    found = [part for part in folder.glob("part-*") if part.is_dir() and part.name[5:].isdecimal()]
    for part in found:
        files.inside(part, folder)
    return sorted(found, key=lambda part: int(part.name[5:]))


def index(folder: Path) -> dict[str, Any]:
    """Entry `parts` of the top case.json: for each part its rows and its first and last `tick` and `t` (s)."""
    return {"parts": [entry for part in part_folders(folder) if (entry := _entry(part)) is not None]}


def _entry(part: Path) -> dict[str, Any] | None:
    files.inside(part / PARQUET, part)
    try:
        found = pq.read_metadata(part / PARQUET)
    except (pa.ArrowException, OSError):
        return None  # not converted yet, or damaged
    entry: dict[str, Any] = {"folder": part.name, "rows": found.num_rows}
    groups = [found.row_group(g) for g in (0, found.num_row_groups - 1)] if found.num_row_groups else []
    for k, name in enumerate(found.schema.names):
        ends = [group.column(k).statistics for group in groups]
        if name in ("tick", "t") and ends and all(end is not None and end.has_min_max for end in ends):
            entry[name] = [ends[0].min + 0, ends[1].max + 0]  # -0.0 is 0
    return entry


def recordings(folder: Path) -> list[Path]:
    """Parquet files of a finished bundle: its own file, or the files of its parts."""
    path = files.inside(folder / PARQUET, folder)
    if path.is_file():
        return [path]
    parts = part_folders(folder)
    if (folder / ARROWS).exists() or any((part / ARROWS).exists() for part in parts):
        raise UserError(f"{folder} holds a recording that was not finished; run: rtctl trace repair {folder}")
    if not parts:
        raise UserError(f"{folder / PARQUET} is missing; a bundle holds {PARQUET} and {CASE}")
    told = load_case(folder).get("parts")
    there = [part.name for part in parts if (part / PARQUET).is_file()]
    if not isinstance(told, list) or [e.get("folder") for e in told if isinstance(e, dict)] != there:
        raise UserError(
            f"{folder / CASE} lists other parts than the folder holds ({', '.join(there[:20]) or 'none'}); "
            f"run: rtctl trace repair {folder}"
        )
    return [files.inside(folder / name / PARQUET, folder) for name in there]


def _table(paths: list[Path]) -> pa.Table:
    """Table of the rows of all files, concatenated."""
    tables: list[pa.Table] = []
    for path in paths:
        try:
            with pq.ParquetFile(path) as file:  # read_table would load datasets and pandas: 0.5 s
                tables.append(file.read())
            tables[-1].column_names  # noqa: B018  Arrow decodes names, and fails, only on access
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            raise UserError(f"{path} cannot be read as Parquet: {_first_line(error)}") from None
        if not tables[-1].schema.equals(tables[0].schema):
            raise UserError(f"{path} has other columns than {paths[0]}; they are not parts of one recording")
    return pa.concat_tables(tables)


def no_folder(folder: Path | str) -> UserError:
    """UserError for a bundle that is not a folder."""
    return UserError(f"{folder} is not a folder; a bundle is a folder with {PARQUET} and {CASE}")


def load_case(folder: Path) -> dict[str, Any]:
    """Read case.json. Raises UserError where it is missing, is not JSON or is of a later format."""
    path = files.inside(folder / CASE, folder)
    try:
        case = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        if not Path(folder).is_dir():
            raise no_folder(folder) from None
        raise UserError(f"{path} is missing; it holds the nominal model of the machine") from None
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}") from error  # may be temporary
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is not text in UTF-8: byte {error.start}") from None
    except json.JSONDecodeError as error:
        raise UserError(f"{path}, line {error.lineno}: not JSON, {error.msg}") from None
    except RecursionError:
        raise UserError(f"{path} is nested too deeply to be a case") from None
    if not isinstance(case, dict):
        raise UserError(f"{path} holds a {type(case).__name__}; it should hold one object {{...}}")
    if case.get("format", 1) not in FORMATS:
        raise UserError(f"{path}: format is {case['format']!r}; this program reads formats 1 and 2")
    return case


def save_case(folder: Path, case: dict[str, Any]) -> Path:
    """Write case.json atomically; returns its path."""
    path = Path(folder) / CASE
    files.write_text(path, as_json(case, indent=1) + "\n", sync=True)
    return path


def as_json(case: dict[str, Any], indent: int | None = None) -> str:
    """JSON text of a case. Accepts numpy numbers, arrays and paths. Raises ValueError for nan and inf."""
    return json.dumps(case, indent=indent, default=_plain, allow_nan=False)


def write_parquet(folder: Path, batches: Iterable[pa.RecordBatch], schema: pa.Schema, expect: int | None = None) -> int:
    """Write recording.parquet in constant memory, verify it and move it into place; returns its number of rows.

    Raises OSError where the write fails, or where the file holds other than the written (or `expect`) number of rows.
    """
    rows = 0
    with files.replaced(folder / PARQUET, "wb", sync=True) as file:
        with pq.ParquetWriter(file, schema, compression="zstd") as writer:
            for table in _groups(batches, schema):
                writer.write_table(table, row_group_size=ROW_GROUP)
                rows += table.num_rows
        file.seek(0)
        found = pq.read_metadata(file).num_rows
        wanted = rows if expect is None else expect
        if found != wanted:
            raise OSError(f"{folder / PARQUET} would hold {found} rows where {wanted} were recorded")
    return rows


def _groups(batches: Iterable[pa.RecordBatch], schema: pa.Schema) -> Iterable[pa.Table]:
    waiting: list[pa.RecordBatch] = []
    rows = 0
    for batch in batches:
        waiting.append(batch)
        rows += batch.num_rows
        if rows >= ROW_GROUP:
            yield pa.Table.from_batches(waiting, schema)
            waiting, rows = [], 0
    if waiting:
        yield pa.Table.from_batches(waiting, schema)


def _numbers(path: Path, name: str, column: pa.ChunkedArray) -> np.ndarray:
    kind = column.type
    if column.null_count == len(column) > 0:
        return np.full(len(column), np.nan)  # unknown column, such as the reference of an unknown law
    if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)):
        raise UserError(f"{path}: column '{name}' holds {kind}; it should hold numbers")
    if column.null_count:
        raise UserError(f"{path}: column '{name}' has {column.null_count} empty cells; every row needs a number")
    if pa.types.is_boolean(kind):
        return column.to_numpy()
    return np.concatenate([np.empty(0, _dtype(kind)), *map(_values, column.chunks)])


def _values(chunk: pa.Array) -> np.ndarray:
    """Numbers of a column without empty cells, without a copy. `to_numpy` would import an installed pandas: 0.5 s."""
    data = chunk.buffers()[1]
    kind = _dtype(chunk.type)
    return np.frombuffer(data, kind)[chunk.offset : chunk.offset + len(chunk)] if data else np.empty(0, kind)


def _dtype(kind: pa.DataType) -> np.dtype:
    letter = "f" if pa.types.is_floating(kind) else "u" if pa.types.is_unsigned_integer(kind) else "i"
    return np.dtype(f"<{letter}{kind.bit_width // 8}")


def _plain(value: Any) -> Any:
    """JSON value of a numpy number, a numpy array or a path."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"case.json cannot hold a {type(value).__name__}")


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
