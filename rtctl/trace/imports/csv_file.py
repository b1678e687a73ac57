"""Reader of text with a line for each row: comma, semicolon, tab, pipe or white space between the cells.

Separator and position of names, units and rows are detected (text_form.py). The decimal sign is one for the whole file
(numerals.py). The user's settings take precedence.
"""

import codecs
import io
import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv

from rtctl.config.errors import UserError
from rtctl.trace.imports import numerals
from rtctl.trace.imports.limits import refuse_large
from rtctl.trace.imports.names import named
from rtctl.trace.imports.table import Table
from rtctl.trace.imports.text_form import Form, TextPlan, cells, form_of, is_comment

HEAD = 1 << 16  # characters read to detect the form of the file
TAKES = 4  # bytes of memory for each byte of text, estimated: text twice, cells, numbers
MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
NAN = ["", "nan", "NaN", "NAN", "-nan", "null", "NULL", "N/A", "n/a"]


def read(path: Path, plan: TextPlan | None = None) -> Table:
    """The columns of a text file. Raises UserError, OSError."""
    plan = plan or TextPlan()
    text, note = _text(path, plan.encoding)
    head = text[:HEAD]
    form = form_of(path, (head if len(head) == len(text) else head[: head.rfind("\n") + 1] or head).split("\n"), plan)
    found = _columns(path, text, form, plan.decimal)
    names, units, notes = _heads(path, form)
    columns = {name: values for name, values in zip(names, found, strict=True) if name is not None}
    notes = [*notes, note] if note else notes
    return Table(path, columns, units, where=lambda row: f"line {_line(text, form, row)}", notes=tuple(notes))


def _text(path: Path, given: str | None) -> tuple[str, str]:
    """Text of the file with line feeds as line ends, and a note on its encoding. Raises UserError."""
    refuse_large(path, TAKES * path.stat().st_size, "its text and numbers")
    raw = path.read_bytes()
    if not raw.strip():
        raise UserError(f"{path} is empty")
    encoding = given or next((name for mark, name in MARKS if raw.startswith(mark)), None)
    if encoding is None and b"\0" in raw[:HEAD]:
        raise UserError(
            f"{path} is not text; if it is UTF-16 without a mark, --encoding utf-16-le or utf-16-be says so"
        )
    note = ""
    try:
        text = raw.decode(encoding or "utf-8")
    except LookupError:
        raise UserError(f"--encoding {given}: no such encoding; utf-8, utf-16, latin-1 and cp1252 are some") from None
    except UnicodeError as error:
        if encoding is not None:
            line = raw.count(b"\n", 0, getattr(error, "start", 0)) + 1
            raise UserError(f"{path}:{line}: this is not {encoding}; --encoding names another") from None
        text, note = raw.decode("cp1252", errors="replace"), "the text is not UTF-8; it was read as cp1252"
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return text.replace("\u2212", "-"), note  # the minus of typesetters


def _columns(path: Path, text: str, form: Form, decimal: str | None) -> list[np.ndarray]:
    """Values (n,) of each column. Raises UserError."""
    body = _body(text, form)
    careful = decimal == "," or (b'"' in body if form.separator == "," else b"," in body)
    columns = _cells(path, body, text, form, careful)
    full = pc.is_valid(columns[0])
    for column in columns[1:]:
        full = pc.or_(full, pc.is_valid(column))
    if not pc.all(full).as_py():  # spreadsheets write rows of only separators at the end
        columns = [column.filter(full) for column in columns]
    if decimal is None:
        decimal = "."
        if careful or (form.separator != "," and _may_group(body, form)):
            texts = columns if careful else _cells(path, body, text, form, True)
            decimal = numerals.decimal_sign(path, texts, lambda cell: f"line {_line_with(text, form, cell)}")
    return [_values(column, decimal) for column in columns]


def _body(text: str, form: Form) -> bytes:
    """Rows as UTF-8 with one separator between the cells."""
    at = 0
    for _ in range(form.first):
        at = text.find("\n", at) + 1
        if not at:
            return b""
    if form.separator != " ":
        return text[at:].encode()
    return "\n".join(" ".join(line.split()) for line in text[at:].split("\n")).encode()


def _may_group(body: bytes, form: Form) -> bool:
    """Whether the dots of a file without commas may group thousands: no certain decimal point in its first rows."""
    point = re.compile(numerals.DECIDES["."])
    lines = itertools.islice((line for line in body.split(b"\n", 2000) if b"." in line), 1000)
    found = (cell for line in lines for cell in cells(line.decode("utf-8", "replace"), form.separator))
    return b"." in body and not any(point.match(cell) for cell in found)


def _cells(path: Path, body: bytes, text: str, form: Form, as_text: bool) -> list[pa.ChunkedArray]:
    """Columns as Arrow reads them, or as texts. Raises UserError."""
    names = [str(k) for k in range(form.width)]
    if not body.strip():
        return [pa.chunked_array([pa.array([], pa.float64())]) for _ in names]
    strange: list[str] = []

    def odd(row: Any) -> str:
        if is_comment(row.text) or not row.text.strip(form.separator + " \t"):
            return "skip"
        strange.append(row.text)
        return "error"

    try:
        table = pa_csv.read_csv(
            io.BytesIO(body),
            pa_csv.ReadOptions(use_threads=False, column_names=names),
            pa_csv.ParseOptions(delimiter=form.separator, invalid_row_handler=odd),
            pa_csv.ConvertOptions(
                column_types={name: pa.string() for name in names} if as_text else None,
                null_values=NAN, strings_can_be_null=True, quoted_strings_can_be_null=True,
            ),
        )  # fmt: skip
    except pa.ArrowException as error:
        if strange:
            have = len(cells(strange[0], form.separator))
            raise UserError(
                f"{path}: line {_line_of(text, strange[0], form)} has {have} cells and the rows have {form.width}; "
                "mend that line, or leave it out"
            ) from None
        raise UserError(f"{path}: the rows cannot be read: {str(error).splitlines()[0]}") from None
    return list(table.columns)


def _values(column: pa.ChunkedArray, decimal: str) -> np.ndarray:
    """Numbers (n,), else dates or durations, else unchanged texts."""
    kind = column.type
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    if pa.types.is_time(kind):  # of the day: a duration since midnight
        return column.cast(pa.int64() if kind.bit_width == 64 else pa.int32()).to_numpy().astype(f"m8[{kind.unit}]")
    if not pa.types.is_string(kind):
        return column.to_numpy()
    found = numerals.numbers(column, decimal)
    if found is not None:
        return found.to_numpy()
    return np.asarray(column.to_numpy(), dtype=object) if (dates := _dates(column)) is None else dates


def _dates(column: pa.ChunkedArray) -> np.ndarray | None:
    """Dates (ISO 8601, or 26.11.2026) or times of day (n,) of a column of texts; None for other texts."""
    texts = pc.utf8_trim_whitespace(column)
    texts = pc.replace_substring_regex(texts, r"^([^,]*:\d\d),(\d+)", r"\1.\2")
    texts = pc.replace_substring_regex(texts, r"^(\d\d)\.(\d\d)\.(\d{4})", r"\3-\2-\1")
    texts = pc.replace_substring_regex(texts, r"^(\d\d:\d\d)", r"1970-01-01 \1")
    for kind in (pa.timestamp("ns"), pa.timestamp("ns", "UTC")):
        try:
            return texts.cast(kind).cast(pa.int64()).to_numpy().astype("M8[ns]")
        except pa.ArrowException:
            continue
    return None


def _heads(path: Path, form: Form) -> tuple[list[str | None], dict[str, str], list[str]]:
    """Names (None: unnamed column, left out), units by name, and notes. Raises UserError."""
    lines = "1 line" if form.passed == 1 else f"{form.passed} lines"
    notes = [f"{lines} before the names {'was' if form.passed == 1 else 'were'} passed over"] if form.passed else []
    if form.names is None:
        return [str(k + 1) for k in range(form.width)], {str(k + 1): unit for k, unit in form.units.items()}, notes
    names: list[str | None] = []
    units: dict[str, str] = {}
    for k, text in enumerate(form.names):
        name, unit = named(text, k)
        last = k == form.width - 1 and not text.strip()  # a separator ends each line
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
    for number, line in enumerate(text.split("\n"), 1):
        if number > form.first and line.strip(form.separator + ' \t"') and not is_comment(line):
            yield number, line


def _line(text: str, form: Form, row: int) -> int:
    return next(itertools.islice((number for number, _ in _rows(text, form)), row, None), row)


def _line_of(text: str, wanted: str, form: Form) -> int:
    """Number of the line that Arrow refused."""
    whole = wanted.split()
    return next((n for n, line in _rows(text, form) if line.split() == whole), 0)


def _line_with(text: str, form: Form, cell: str) -> int:
    return next((n for n, line in _rows(text, form) if cell in cells(line, form.separator)), 0)
