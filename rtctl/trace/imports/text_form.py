"""Form of a text file with a line for each row: separator, lines of names and units, first row.

Separator, number of cells and numeric columns come from the last lines of the file's head. The first line that matches
them is the first row. The lines of names and units stand above the first row.
"""

import csv
import re
from collections.abc import Sequence
from typing import Literal, NamedTuple

from pydantic import Field, field_validator

from rtctl.config.errors import UserError
from rtctl.config.units import convert
from rtctl.idiom import Settings

SEPARATORS = (";", "\t", "|", ",", " ")  # a space is any white space
COMMENTS = ("#", "%", "//", "!")
NUMBER = re.compile(
    r"[-+]?(?:\d[\d.,' \u2019\u00a0\u2009\u202f]*|[.,]\d+)(?:[eEdD][-+]?\d+)?|[-+]?(?:nan|inf(?:inity)?)", re.IGNORECASE
)
DATE = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?:[T ].*)?|\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?")
UNIT_WORDS = {
    "second": "s", "seconds": "s", "sec": "s", "volt": "V", "volts": "V", "ampere": "A", "amps": "A", "meter": "m",
    "metre": "m", "degree": "deg", "degrees": "deg", "radian": "rad", "newton": "N", "hertz": "Hz",
}  # fmt: skip
NO_UNIT = ("", "-", "1", "none", "sequence", "unitless", "dimensionless")
SAMPLE = 200  # lines of the head used to detect separator and numeric columns
MOSTLY = 0.5  # share of numbers in the sampled lines above which a column is numeric


class TextPlan(Settings):
    """User's description of a text file; an absent setting is detected from the file."""

    separator: str | None = Field(
        default=None, description="between two cells: a sign, `tab`, or `space` for any white space"
    )
    decimal: Literal[".", ","] | None = Field(default=None, description="decimal sign")
    names_line: int | None = Field(default=None, ge=0, description="line of the names, 1 the first; 0: there are none")
    units_line: int | None = Field(default=None, ge=0, description="line of the units; 0: there are none")
    skip: int = Field(default=0, ge=0, description="lines at the top that are passed over")
    encoding: str | None = Field(default=None, description="of the characters, such as utf-16 or cp1252")

    @field_validator("separator")
    @classmethod
    def _one_sign(cls, given: str | None) -> str | None:
        sign = {"tab": "\t", "\\t": "\t", "space": " "}.get(given or "", given)
        if sign is not None and (len(sign) != 1 or sign.isalnum() or sign in '\n\r".'):
            raise ValueError("should be one sign, such as ; or |, or tab, or space")
        return sign


class Form(NamedTuple):
    separator: str
    width: int  # cells a row
    first: int  # line of the first row, 0 the first of the file
    names: list[str] | None
    units: dict[int, str]  # column -> unit, where a line of units is given
    passed: int  # non-blank lines above names and rows that are skipped


def cells(line: str, separator: str) -> list[str]:
    """Cells of a line, without quotes and outer white space."""
    if separator == " ":
        return line.split()
    try:
        found = next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        found = line.split(separator)
    return [cell.strip() for cell in found]


def is_value(cell: str) -> bool:
    """Whether a cell holds a number in any notation, or a date."""
    return bool(NUMBER.fullmatch(cell) or DATE.fullmatch(cell))


def form_of(path: object, lines: list[str], plan: TextPlan) -> Form:
    """Form of the file whose first lines are `lines`. Raises UserError."""
    start = plan.skip
    separator = plan.separator
    if len(lines) > start and re.fullmatch(r"sep=.", lines[start].strip("\r\n\ufeff\"' ")):
        separator = separator or lines[start].strip("\r\n\ufeff\"' ")[4]
        start += 1
    full = [k for k in range(start, len(lines)) if lines[k].strip()]
    if not full:
        raise UserError(f"{path} holds no line of names or numbers")
    body = [k for k in full if not is_comment(lines[k])][-SAMPLE:] or full[-1:]
    body = body[len(body) // 2 :]  # the first half may hold lines that are no rows
    separator = separator or _separator([lines[k] for k in body])
    rows = [cells(lines[k], separator) for k in body]
    width = _usual([len(row) for row in rows], [len(cells(lines[k], separator)) for k in full])
    rows = [row for row in rows if len(row) == width]
    numeric = [k for k in range(width) if sum(is_value(row[k]) for row in rows) > MOSTLY * len(rows)]
    names_line = plan.names_line - 1 if plan.names_line else None
    if names_line is not None and names_line >= len(lines):
        raise UserError(f"{path}: there is no line {plan.names_line} for the names; the file has {len(lines)} lines")
    after = max(names_line if names_line is not None else -1, (plan.units_line or 0) - 1)
    first = _first_row(lines, full, separator, width, numeric, after)
    ended = all(not row[-1] for row in rows)  # each row ends in a separator
    names, units, used = _names(lines, [k for k in full if k < first], separator, width, ended, names_line, plan)
    if names is None and plan.names_line is None:
        _refuse_other_names(path, lines, first, separator, width)
    passed = sum(1 for k in full if k < first and k not in used and not is_comment(lines[k]))
    return Form(separator, width, first, names, units, passed)


def _refuse_other_names(path: object, lines: list[str], first: int, separator: str, width: int) -> None:
    """Raise UserError where the line above the first row has names, but not one for each cell."""
    found = cells(lines[first - 1], separator) if 0 < first < len(lines) and not is_comment(lines[first - 1]) else []
    if len(found) > 1 and all(cell and not is_value(cell) and unit_of(cell) is None for cell in found):
        signs = "; is a comma both decimal sign and separator?" if separator == "," and width % len(found) == 0 else ""
        raise UserError(
            f"{path}: line {first} has {len(found)} names and the rows have {width} cells{signs}; mend one of them, or "
            "--names-line 0 takes the columns by their numbers"
        )


def _separator(lines: list[str]) -> str:
    """Separator that gives most lines the same number of cells, and most of these cells numbers."""
    best, chosen = (-1.0, -1.0), ","
    for separator in SEPARATORS:
        rows = [cells(line, separator) for line in lines]
        width = _usual([len(row) for row in rows])
        if width < 2:
            continue
        alike = [row for row in rows if len(row) == width]
        found = [cell for row in alike for cell in row if cell]
        numbers = sum(map(is_value, found)) / max(len(found), 1)
        score = (round(numbers * len(alike) / len(rows), 2), float(separator != " "))
        if score > best:
            best, chosen = score, separator
    return chosen


def _usual(widths: list[int], others: Sequence[int] = ()) -> int:
    """Most frequent width; ties are decided by the frequency in `others`."""
    return max(set(widths), key=lambda width: (widths.count(width), others.count(width), width))


def is_comment(line: str) -> bool:
    """Whether a line is a comment."""
    return line.lstrip("\ufeff \t").startswith(COMMENTS)


def _first_row(lines: list[str], full: list[int], separator: str, width: int, numeric: list[int], after: int) -> int:
    for k in full:
        row = cells(lines[k], separator)
        if k <= after or len(row) != width or is_comment(lines[k]):
            continue
        filled = all(is_value(row[n]) or not row[n] for n in numeric) and any(row[n] for n in numeric)
        if filled or (not numeric and k > full[0]):
            return k
    return len(lines)  # names without rows


def _names(
    lines: list[str], before: list[int], separator: str, width: int, ended: bool, names_line: int | None, plan: TextPlan
) -> tuple[list[str] | None, dict[int, str], set[int]]:
    """Names, units by column, and the line numbers of both."""
    if plan.names_line == 0:
        return None, {}, set()
    fitting = [k for k in before if len(_heading(lines[k], separator, width, ended)) == width]
    units: dict[int, str] = {}
    used: set[int] = set()
    units_line = plan.units_line - 1 if plan.units_line else None
    if plan.units_line is None and len(fitting) > 1 and fitting[-1] != names_line:
        last = _heading(lines[fitting[-1]], separator, width, ended)
        if fitting[-1] - fitting[-2] <= 2 and all(unit_of(cell) is not None or is_value(cell) for cell in last):
            units_line = fitting[-1]
    if units_line is not None:
        found = _heading(lines[units_line], separator, width, ended)
        units = {k: unit for k, cell in enumerate(found) if (unit := unit_of(cell)) is not None}
        used.add(units_line)
    if names_line is None:
        left = [k for k in fitting if k not in used]
        left = [
            k for k in left if not is_comment(lines[k])
        ] or left  # without another line, the last comment with as many cells
        names_line = left[-1] if left else None
    if names_line is None:
        return None, units, used
    used.add(names_line)
    return _heading(lines[names_line], separator, width, ended), units, used


def _heading(line: str, separator: str, width: int, ended: bool) -> list[str]:
    """Cells of a line of names without comment sign; an empty cell at the end is added or removed to fit."""
    line = line.lstrip("\ufeff")
    bare = line.lstrip()
    if mark := next((mark for mark in COMMENTS if bare.startswith(mark)), ""):
        bare = bare[len(mark) :].lstrip("#%/! ") if separator != "\t" else bare[len(mark) :]
    found = cells(bare.strip("\r\n") if mark else line.strip("\r\n"), separator)
    if ended and len(found) == width - 1:
        found.append("")
    if len(found) == width + 1 and not found[-1]:
        found.pop()
    return found


def unit_of(cell: str) -> str | None:
    """Unit in a cell of a line of units: `(ms)`, `[V]`, `mm`, `second`; "" for no unit; None for other text."""
    bare = cell.strip().strip("()[]").strip()
    if bare.casefold() in NO_UNIT:
        return ""
    if bare.casefold() in UNIT_WORDS:
        return UNIT_WORDS[bare.casefold()]
    try:
        convert(1.0, bare, bare)
    except ValueError:
        return None
    return bare
