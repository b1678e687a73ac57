"""Text with a line for each row. What parts the cells (comma, semicolon, tab) is seen from the first line.

The first line names the columns, with a unit in brackets where it is known: `x [mm]`. Where it holds numbers, the
columns are called 1, 2, 3. Lines before it that start with # or % are passed over.
"""

import codecs
import csv
import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv

from rtctl.config.errors import UserError
from rtctl.trace.imports.table import Table

HEAD = 65_536  # bytes from which the form of the file is seen
NAMED = re.compile(r"\s*(.+?)\s*(?:\[([^][]*)\]|\(([^()]*)\))?\s*")
NO_UNIT = ("-", "1", "none")


class Form(NamedTuple):
    encoding: str
    delimiter: str
    decimal: str
    before: int  # lines that are passed over
    header: list[str] | None  # None: the first line holds numbers


def read(path: Path) -> Table:
    """The columns of a text file. Raises UserError, OSError."""
    form = _form(path)
    try:
        table = pa_csv.read_csv(
            path,
            pa_csv.ReadOptions(
                use_threads=False,  # so that a message knows the row
                encoding=form.encoding,
                skip_rows=form.before,
                autogenerate_column_names=form.header is None,
            ),
            pa_csv.ParseOptions(delimiter=form.delimiter),
            pa_csv.ConvertOptions(decimal_point=form.decimal),
        )
    except pa.ArrowException as error:
        raise UserError(f"{path}: {str(error).splitlines()[0]}") from None
    names, units = [], {}
    for k, text in enumerate(form.header or ()):
        name, unit = _named(text, k)
        names.append(name)
        if unit is not None:
            units[name] = unit
    names = names or [str(k + 1) for k in range(table.num_columns)]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{path}: two columns are called '{twice}'; give each a name of its own in the first line")
    columns = {n: _values(c) for n, c in zip(names, table.columns, strict=True)}
    return Table(path, columns, units, where=_lines(path, form.before + (form.header is not None)))


def _values(column: pa.ChunkedArray) -> np.ndarray:
    return np.full(len(column), np.nan) if pa.types.is_null(column.type) else column.to_numpy()


def _form(path: Path) -> Form:
    with path.open("rb") as file:
        head = file.read(HEAD)
    if not head.strip():
        raise UserError(f"{path} is empty")
    if b"\0" in head:
        raise UserError(f"{path} is not text")
    try:
        codecs.getincrementaldecoder("utf-8-sig")().decode(head, final=len(head) < HEAD)
        encoding = "utf8"
    except UnicodeDecodeError:
        encoding = "latin-1"  # what spreadsheets write on some machines
    lines = head.decode("utf-8-sig" if encoding == "utf8" else encoding, errors="replace").splitlines()
    before = len(list(itertools.takewhile(lambda line: not line.strip() or line.lstrip()[:1] in "#%", lines)))
    if before == len(lines):
        raise UserError(f"{path} holds no line of names or numbers")
    first = lines[before]
    delimiter = max(",;\t", key=first.count)
    decimal = "," if delimiter != "," and any("," in line for line in lines[before + 1 : before + 20]) else "."
    cells = next(csv.reader([first], delimiter=delimiter))
    numbers = all(_is_number(cell.replace(decimal, ".")) for cell in cells)
    return Form(encoding, delimiter, decimal, before, None if numbers else cells)


def _named(text: str, number: int) -> tuple[str, str | None]:
    """Name and unit of a cell such as `x [mm]`; the number of the column where it is empty."""
    match = NAMED.fullmatch(text)
    if match is None:
        return str(number + 1), None
    unit = match[2] if match[2] is not None else match[3]
    return match[1], None if unit is None else "" if unit.strip() in NO_UNIT else unit.strip()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _lines(path: Path, before: int) -> Callable[[int], str]:
    """How a row is called: by its line in the file, as an editor counts; empty lines are no rows."""

    def where(row: int) -> str:
        with path.open("rb") as file:
            full = (n for n, line in enumerate(file, 1) if n > before and line.strip())
            return f"line {next(itertools.islice(full, row, None), row)}"

    return where
