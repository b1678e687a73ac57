"""Pieces of recordings, one for each estimate: a short bundle whole, a long bundle in windows.

A piece is read by itself: of a Parquet file only the row groups that hold it, so that the memory does not grow with the
length of a recording.
"""

import json
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from rtctl import __version__
from rtctl.config.errors import UserError
from rtctl.diagnose.folder import is_bundle
from rtctl.trace.bundle import CASE, Bundle, columns_of_table, load_case, recordings, units_of

WINDOW = 60.0  # s, of a piece of a long recording
SHORTEST = 0.5  # of a window: a shorter last piece belongs to the piece before


class Piece(NamedTuple):
    """Rows of one bundle, with their place, time and stamp."""

    folder: str
    machine: str
    first: int  # row
    rows: int
    begin: float  # s, clock of the first row
    seconds: float
    at: float  # s since 1970 of the first row; nan where the recording has no date
    stamp: str  # of the inputs of an estimate: times and sizes of the files, version of the program


def bundles_in(paths: Sequence[Path]) -> list[Path]:
    """Bundles among the paths, and below those that are folders of bundles, in the order of their names.

    Raises UserError where a path is no folder, or holds no bundle.
    """
    out: list[Path] = []
    for path in paths:
        if not path.is_dir():
            raise UserError(f"{path} is not a folder; it should be a bundle or a folder of bundles")
        found = [path] if is_bundle(path) else sorted(_below(path))
        if not found:
            raise UserError(f"{path} holds no bundle; a bundle is a folder with recording.parquet and {CASE}")
        out += [one for one in found if one not in out]
    return out


def _below(folder: Path) -> Iterator[Path]:
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            if is_bundle(path):
                yield path
            else:
                yield from _below(path)


def pieces_of(folder: Path, window: float = WINDOW) -> list[Piece]:
    """Pieces of a bundle of about `window` s each. Raises UserError where it cannot be read."""
    case = load_case(folder)
    paths = recordings(folder)
    spans, start = [], 0
    for path in paths:
        rows, first, last = _span(path)
        spans.append((start, rows, first, last))
        start += rows
    begin, seconds, rows = spans[0][2], spans[-1][3] - spans[0][2], start
    if rows < 2 or not seconds > 0.0:
        raise UserError(f"{paths[0]} holds {rows} rows; an estimate needs a recording of some seconds")
    count = max(1, int(seconds / window + 1.0 - SHORTEST))
    size = -(-rows // count)
    dated, stamp, machine = _dated(case), _stamp(folder, paths), _machine(case, folder)
    out = []
    for first in range(0, rows, size):
        n = min(size, rows - first)
        offset = seconds * first / (rows - 1)
        out.append(
            Piece(
                str(folder),
                machine,
                first,
                n,
                begin + offset,
                seconds * n / rows,
                dated + offset,
                f"{stamp} {first} {n}",
            )
        )
    return out


def _span(path: Path) -> tuple[int, float, float]:
    """Rows of a file, and its first and last time, s: by the statistics of its row groups, else by its rows."""
    try:
        with pq.ParquetFile(path) as file:
            found = file.metadata
            if not found.num_rows:
                return 0, 0.0, 0.0
            names = found.schema.names
            if "t" not in names:
                raise UserError(f"{path} has no column 't' (s, clock at the tick)")
            ends = [found.row_group(g).column(names.index("t")).statistics for g in (0, found.num_row_groups - 1)]
            if all(end is not None and end.has_min_max for end in ends):
                return found.num_rows, float(ends[0].min), float(ends[1].max)
            t = file.read(["t"]).column("t")
            return found.num_rows, float(t[0].as_py()), float(t[-1].as_py())
    except (pa.ArrowException, OSError) as error:
        raise UserError(f"{path} cannot be read as Parquet: {str(error).splitlines()[0]}") from None


def _dated(case: dict[str, Any]) -> float:
    """Begin of the recording in s since 1970; nan where it has no date."""
    try:
        return datetime.fromisoformat(str(case.get("recorded_at"))).timestamp()
    except ValueError:
        return float("nan")


def _machine(case: dict[str, Any], folder: Path) -> str:
    """Name of the machine: `group` of the case, or `name` of the config that recorded it, or the folder around it."""
    config = case.get("config")
    named = config.get("name") if isinstance(config, dict) else None
    return str(case.get("group") or named or folder.resolve().parent.name)


def _stamp(folder: Path, paths: Sequence[Path]) -> str:
    files = [folder / CASE, *paths]
    told = [(file.stat().st_mtime_ns, file.stat().st_size) for file in files]
    return f"{__version__} {json.dumps(told, separators=(',', ':'))}"


def read(piece: Piece) -> Bundle:
    """The rows of a piece as a bundle, in memory for one window and one row group. Raises UserError."""
    folder = Path(piece.folder)
    tables, start = [], 0
    wanted = range(piece.first, piece.first + piece.rows)
    paths = recordings(folder)
    for path in paths:
        with pq.ParquetFile(path) as file:
            for group in range(file.num_row_groups):
                n = file.metadata.row_group(group).num_rows
                low, high = max(wanted.start, start), min(wanted.stop, start + n)
                if low < high:
                    tables.append(file.read_row_group(group).slice(low - start, high - low))
                start += n
    table = pa.concat_tables(tables)
    return Bundle(columns_of_table(paths[0], table), load_case(folder), folder, units_of(table.schema))
