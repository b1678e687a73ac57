"""Text with a line for each row: comma, semicolon, tab, pipe or white space between the cells.

Where names, units and rows stand, and what parts the cells, is seen from the file (text_form.py); the decimal sign is
that of the whole file (numerals.py). What the owner says goes first.
"""

import codecs
import gzip
import io
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv

from rtctl.config.errors import UserError
from rtctl.trace.imports import numerals
from rtctl.trace.imports.names import named
from rtctl.trace.imports.table import Table
from rtctl.trace.imports.text_form import COMMENTS, Form, Options, cells, form_of

HEAD = 65_536  # characters from which the form of the file is seen
MOST = 2 << 30  # bytes of text; beyond it is cut into parts by its owner
MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
NAN = ["", "nan", "NaN", "NAN", "-nan", "null", "NULL", "N/A", "n/a"]


def read(path: Path, options: Options | None = None) -> Table:
    """The columns of a text file. Raises UserError, OSError."""
    options = options or Options()
    text, encoding = _text(path, options.encoding)
    form = form_of(path, text[:HEAD].splitlines(), options)
    lines = text.split("\n") if form.separator == " " or "\r" in text[:HEAD] else None
    if lines is not None:
        lines = text.splitlines()
    body = _body(text, lines, form)
    columns = _columns(path, body, text, form, options.decimal)
    names, units, notes = _heads(path, form)
    if encoding not in ("utf-8", "utf-8-sig", "utf-16"):
        notes.append(f"the text is not UTF-8; it was read as {encoding}")
    found = {name: columns[k] for k, name in enumerate(names) if name is not None and k in columns}
    return Table(path, found, units, where=lambda row: f"line {_line(text, form, row)}", notes=tuple(notes))


def _text(path: Path, given: str | None) -> tuple[str, str]:
    """The file's text and its encoding. Raises UserError."""
    size = path.stat().st_size
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        try:
            raw = (gzip.GzipFile(fileobj=file) if packed else file).read(MOST + 1)
        except (EOFError, gzip.BadGzipFile) as error:
            raise UserError(f"{path}: the gzip file is damaged or cut off ({error}); fetch it again") from None
    if size > MOST or len(raw) > MOST:
        raise UserError(f"{path}: more than {MOST >> 30} GiB of text; cut it into parts, or use Parquet")
    if not raw.strip():
        raise UserError(f"{path} is empty")
    encoding = given or next((name for mark, name in MARKS if raw.startswith(mark)), None)
    if encoding is None and b"\0" in raw[:HEAD]:
        raise UserError(f"{path} is not text; if it is UTF-16 without a mark, --encoding utf-16-le or utf-16-be says so")
    try:
        return raw.decode(encoding or "utf-8"), encoding or "utf-8"
    except LookupError:
        raise UserError(f"--encoding {given}: no such encoding; utf-8, utf-16, latin-1 and cp1252 are some") from None
    except UnicodeDecodeError as error:
        if encoding is not None:
            line = raw.count(b"\n", 0, error.start) + 1
            raise UserError(f"{path}:{line}: is not {encoding}; --encoding names another") from None
        return raw.decode("cp1252", errors="replace"), "cp1252"  # what spreadsheets write on some machines


def _body(text: str, lines: list[str] | None, form: Form) -> bytes:
    """The rows, as UTF-8 with one separator between the cells."""
    if lines is not None:
        rows = lines[form.first :]
        if form.separator == " ":
            rows = [" ".join(line.split()) for line in rows]
        return "\n".join(rows).encode()
    at = 0
    for _ in range(form.first):
        at = text.index("\n", at) + 1
    return text[at:].encode()


def _columns(path: Path, body: bytes, text: str, form: Form, decimal: str | None) -> dict[int, np.ndarray]:
    """Cells by column. Raises UserError."""
    plain = (decimal or ".") == "." and b"," not in body.replace(b",", b"", 0) if form.separator != "," else False
    quoted = form.separator == "," and b'"' in body
    careful = decimal is not None or quoted or (form.separator != "," and not plain)
    names = [str(k) for k in range(form.width)]
    types = {name: pa.string() for name in names} if careful else None
    strange: list[str] = []

    def odd(row: Any) -> str:
        if row.text.lstrip().startswith(COMMENTS) or not row.text.strip(form.separator + " \r"):
            return "skip"
        strange.append(row.text)
        return "error"

    try:
        table = pa_csv.read_csv(
            io.BytesIO(body),
            pa_csv.ReadOptions(use_threads=False, column_names=names),
            pa_csv.ParseOptions(delimiter=form.separator, invalid_row_handler=odd),
            pa_csv.ConvertOptions(column_types=types, null_values=NAN, strings_can_be_null=True, quoted_strings_can_be_null=True),
        )
    except pa.ArrowException as error:
        if strange:
            have = len(cells(strange[0], form.separator))
            raise UserError(
                f"{path}: line {_line_of(text, strange[0])} has {have} cells and the rows {form.width}; mend that line, "
                "or leave it out"
            ) from None
        raise UserError(f"{path}: the rows cannot be read: {str(error).splitlines()[0]}") from None
    columns = {k: table.column(k) for k in range(form.width)}
    if careful:
        return _converted(path, columns, text, form, decimal)
    return {k: _values(column) for k, column in columns.items()}


def _converted(
    path: Path, columns: dict[int, pa.ChunkedArray], text: str, form: Form, decimal: str | None
) -> dict[int, np.ndarray]:
    """Columns of texts as numbers or dates, by one decimal sign."""
    texts = {k: np.asarray(column.to_numpy(), dtype=object) for k, column in columns.items()}
    if decimal is None:
        some = (str(cell).strip() for column in texts.values() for cell in column if cell is not None)
        decimal, _ = numerals.decimal_sign(path, some, lambda cell: f"line {_line_with(text, form, cell)}")
    out = {}
    for k, column in texts.items():
        values, wrong = numerals.numbers(column, decimal)
        if wrong is None:
            out[k] = values
            continue
        try:
            out[k] = columns[k].cast(pa.timestamp("ns")).to_numpy()
        except pa.ArrowException:
            out[k] = column
    return out


def _values(column: pa.ChunkedArray) -> np.ndarray:
    return np.full(len(column), np.nan) if pa.types.is_null(column.type) else column.to_numpy()


def _heads(path: Path, form: Form) -> tuple[list[str | None], dict[str, str], list[str]]:
    """Names (None: a column without one that is left out), units by name, and sentences. Raises UserError."""
    notes = [f"{form.passed} lines before the names were passed over"] if form.passed else []
    if form.names is None:
        return [str(k + 1) for k in range(form.width)], {}, notes
    names: list[str | None] = []
    units: dict[str, str] = {}
    for k, text in enumerate(form.names):
        name, unit = named(text, k)
        last = k == form.width - 1 and not text.strip()
        names.append(None if last and form.width > 1 else name)
        unit = form.units.get(k, unit)
        if unit is not None:
            units[name] = unit
    given = [name for name in names if name is not None]
    twice = next((name for name in given if given.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{path}: two columns are called '{twice}'; give each a name of its own in the line of names")
    return names, units, notes


def _rows(text: str, form: Form) -> Iterator[tuple[int, str]]:
    """Line number, as an editor counts, and text of each row."""
    for number, line in enumerate(text.splitlines(), 1):
        if number > form.first and line.strip() and not line.lstrip().startswith(COMMENTS):
            yield number, line


def _line(text: str, form: Form, row: int) -> int:
    return next(itertools.islice((number for number, _ in _rows(text, form)), row, None), row)


def _line_of(text: str, wanted: str) -> int:
    wanted = wanted.strip()
    return next((n for n, line in enumerate(text.splitlines(), 1) if line.strip() == wanted), 0)


def _line_with(text: str, form: Form, cell: str) -> int:
    return next((n for n, line in _rows(text, form) if cell in cells(line, form.separator)), 0)
