"""Source of an export: selected columns and rows of a bundle, read in batches."""

import math
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from rtctl.config.errors import UserError, nearest
from rtctl.trace.bundle import ROW_GROUP, load_case, no_folder, recordings
from rtctl.trace.columns import Column, columns_of


class Selection(NamedTuple):
    """Selection of columns (all if empty; `t` is always included) and rows."""

    columns: tuple[str, ...] = ()
    start: float = -math.inf  # s, in the column t
    end: float = math.inf  # s, in the column t
    every: int = 1  # decimation: the first of each `every` rows, without a filter


ALL = Selection()


class Source:
    """Selected rows of a bundle, of all its parts.

    `columns` start with `t`, `rows` is the number of rows, `case` and `paths` belong to the bundle. Raises UserError
    for an unfinished or invalid bundle, a missing column, or an empty selection.
    """

    def __init__(self, folder: Path | str, selection: Selection = ALL):
        self.folder = Path(folder)
        if not self.folder.is_dir():
            raise no_folder(self.folder)
        self.paths = recordings(self.folder)
        self.case = load_case(self.folder)
        self._selection = selection
        self.schema = self._schema(selection.columns)
        self.columns: list[Column] = columns_of(self.schema)
        self._first, self._last, self.rows = self._extent()

    @property
    def name(self) -> str:
        """Name of the machine for the file: ivu, ldu, axis."""
        return str(self.case.get("plant") or (self.case.get("config") or {}).get("name") or "trace")

    @property
    def started(self) -> datetime | None:
        """Start of the recording with its time zone; None where the case has no start."""
        try:
            found = datetime.fromisoformat(str(self.case.get("recorded_at")))
        except ValueError:
            return None
        return found if found.tzinfo else found.astimezone()

    @property
    def epoch(self) -> int:
        """Time of `t` = 0 in ns since 1970, shifted where a row would be before 1970."""
        began = self.started
        epoch = int(began.timestamp() // 1) * 1_000_000_000 + began.microsecond * 1000 if began else 0
        return max(epoch, math.ceil(-self.span[0]) * 1_000_000_000)

    @property
    def gaps(self) -> set[str]:
        """Names of the columns with missing values (null, not nan)."""
        found: set[str] = set()
        for path in self.paths:
            with _reading(path) as file:
                for group in range(file.metadata.num_row_groups):
                    columns = file.metadata.row_group(group)
                    for n in range(columns.num_columns):
                        one = columns.column(n)
                        if one.statistics is None or one.statistics.null_count != 0:  # None: no count of nulls
                            found.add(one.path_in_schema)
        return found

    @property
    def rate(self) -> float | None:
        """Sample rate of the selection, Hz, from the case; None where the clock is uneven."""
        rate = self.case.get("sample_rate")
        return rate / self._selection.every if isinstance(rate, int | float) and rate > 0 else None

    @property
    def span(self) -> tuple[float, float]:
        """First and last `t` of the selection, s."""
        return self._first, self._last

    def batches(self, names: Sequence[str] | None = None) -> Iterator[pa.RecordBatch]:
        """Batches of the selected rows, at most ROW_GROUP rows each; `names` selects columns."""
        wanted = [column.name for column in self.columns] if names is None else list(names)
        s = self._selection
        schema = pa.schema([self.schema.field(name) for name in wanted])
        passed = 0  # rows between start and end
        for path in self.paths:
            with _reading(path) as file:
                for batch in file.iter_batches(ROW_GROUP, columns=list(dict.fromkeys(("t", *wanted)))):
                    t = batch.column("t").to_numpy(zero_copy_only=False)
                    keep = np.flatnonzero((t >= s.start) & (t <= s.end))
                    chosen = keep[(passed + np.arange(len(keep))) % s.every == 0]
                    passed += len(keep)
                    if len(chosen):
                        rows = batch if len(chosen) == len(t) else batch.take(pa.array(chosen))
                        arrays = [rows.column(name).cast(schema.field(name).type) for name in wanted]
                        yield pa.record_batch(arrays, schema=schema)

    def arrays(self) -> Iterator[dict[str, np.ndarray]]:
        """Batches of the selected rows as arrays by name; nan for a value that was not measured."""
        for batch in self.batches():
            yield {name: batch.column(name).to_numpy(zero_copy_only=False) for name in batch.schema.names}

    def column(self, name: str) -> np.ndarray:
        """Whole column (rows,) of the selection."""
        whole, at = np.empty(0), 0
        for batch in self.batches([name]):
            values = batch.column(0).to_numpy(zero_copy_only=False)
            if not at:
                whole = np.empty(self.rows, values.dtype)
            whole[at : at + len(values)] = values
            at += len(values)
        return whole

    def _schema(self, wanted: Sequence[str]) -> pa.Schema:
        """Schema of the selection: `t`, then `wanted` or all columns. A column of only nulls becomes doubles."""
        found = [_schema_of(path) for path in self.paths]
        for path, schema in zip(self.paths, found, strict=True):
            if not schema.equals(found[0]):
                raise UserError(f"{path} has other columns than {self.paths[0]}; they are not parts of one recording")
        path, schema = self.paths[0], found[0]
        for name in ("t", *wanted):
            if name not in schema.names:
                near = nearest(name, schema.names)
                hint = f"is it '{near}'?" if near else f"it has {', '.join(schema.names)}"
                raise UserError(f"{path} has no column '{name}'; {hint}")
        names = dict.fromkeys(("t", *(wanted or schema.names)))
        return pa.schema([_numbers(path, schema.field(name)) for name in names], schema.metadata)

    def _extent(self) -> tuple[float, float, int]:
        first, last, rows = math.nan, math.nan, 0
        s = self._selection
        for batch in self.batches(["t"]):
            t = batch.column(0).to_numpy(zero_copy_only=False)
            first = float(t[0]) if not rows else first
            last = float(t[-1])
            rows += len(t)
        if not rows:
            some = "" if math.isinf(s.start) else f" from {s.start:g} s on"
            some = some if math.isinf(s.end) else f"{some.removesuffix(' on')} to {s.end:g} s"
            raise UserError(f"{self.folder} holds no rows{some}{self._clock()}")
        return first, last, rows

    def _clock(self) -> str:
        """Time span of the whole recording, for a message."""
        ends = [t for path in self.paths if len(t := pq.read_table(path, columns=["t"]).column(0))]
        return f"; its column t runs from {ends[0][0].as_py():g} s to {ends[-1][-1].as_py():g} s" if ends else ""


def _reading(path: Path) -> pq.ParquetFile:
    try:
        return pq.ParquetFile(path, pre_buffer=False)  # pre_buffer keeps the whole file in memory
    except (pa.ArrowException, OSError) as error:
        raise UserError(f"{path} cannot be read as Parquet: {str(error).splitlines()[0]}") from None


def _schema_of(path: Path) -> pa.Schema:
    with _reading(path) as file:
        try:
            file.schema_arrow.names  # noqa: B018  Arrow decodes names, and fails, only on access
        except UnicodeDecodeError as error:
            raise UserError(f"{path}: the name of a column is not text in UTF-8: {error.object[:20]!r}") from None
        return file.schema_arrow


def _numbers(path: Path, field: pa.Field) -> pa.Field:
    kind = field.type
    if pa.types.is_null(kind):
        return field.with_type(pa.float64())
    if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)):
        raise UserError(f"{path}: column '{field.name}' holds {kind}; it should hold numbers")
    return field
