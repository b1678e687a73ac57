"""Numbers as text: decimal sign of a whole file, and grouped thousands.

One unambiguous cell decides for the file: `0,5`, `12.25` and `1,234.5` have one reading. `1,980` has two: a file with
only ambiguous cells is refused.
"""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from rtctl.config.errors import UserError

SPACES = " '\u2019\u00a0\u2009\u202f"  # further signs between thousands
EXPONENT = r"(?:[eEdD][-+]?\d+)?"


def _decides(sign: str, other: str) -> str:
    """Regular expression of cells where `sign` must be the decimal sign."""
    s, o = re.escape(sign), re.escape(other)
    group = f"[{o}{SPACES}]"
    return (
        rf"^(?:[-+]?(?:\d*{s}(?:\d{{0,2}}|\d{{4,}})|0\d*{s}\d+|\d{{4,}}{s}\d+|\d{{1,3}}(?:{group}\d{{3}})+{s}\d+)"
        rf"{EXPONENT}|[-+]?\d+{s}\d+[eEdD][-+]?\d+)$"
    )


def _grouped(sign: str, least: int) -> str:
    """Regular expression of cells with `sign` between thousands at least `least` times."""
    return rf"^[-+]?\d{{1,3}}(?:{re.escape(sign)}\d{{3}}){{{least},}}$"


OTHER = {".": ",", ",": "."}
DECIDES = {sign: _decides(sign, other) for sign, other in OTHER.items()}
GROUPED = {sign: _grouped(sign, 1) for sign in OTHER}
TWICE = {sign: _grouped(sign, 2) for sign in OTHER}


def decimal_sign(path: Path, columns: Sequence[pa.ChunkedArray], where: Callable[[str], str]) -> str:
    """Decimal sign of a file, from all cells of its text columns.

    `where(text)` names the first row with the cell `text`. Raises UserError for contradictory or ambiguous cells.
    """
    bare = [pc.utf8_trim_whitespace(column) for column in columns]
    found: dict[str, str] = {}
    for sign, other in OTHER.items():
        text = _first(bare, DECIDES[sign]) or _first(bare, TWICE[other])  # 1.234.567 groups by the dot
        if text:
            found[sign] = text
    if len(found) == 2:
        one, two = found["."], found[","]
        raise UserError(
            f"{path}: '{one}' ({where(one)}) has a decimal point and '{two}' ({where(two)}) a decimal comma; "
            "write one of them throughout"
        )
    if found:
        return next(iter(found))
    for sign, other in OTHER.items():
        if text := _first(bare, GROUPED[sign]):
            raise UserError(
                f"{path}: '{text}' ({where(text)}) is {text.replace(sign, '')} or {text.replace(sign, '.')}: nothing "
                f"in the file says whether '{sign}' groups thousands; --decimal '{sign}' if it is the decimal sign, "
                f"--decimal '{other}' if it groups"
            )
    return "."


def _first(columns: Sequence[pa.ChunkedArray], pattern: str) -> str:
    """First matching cell; "" without a match."""
    for column in columns:
        row = pc.index(pc.match_substring_regex(column, pattern), True).as_py()
        if row >= 0:
            return str(column[row].as_py())
    return ""


def numbers(column: pa.ChunkedArray, decimal: str) -> pa.ChunkedArray | None:
    """Doubles of a text column, null for an empty cell; None where any cell is no number."""
    other = OTHER[decimal]
    bare = pc.utf8_trim_whitespace(column)
    for sign in (other, *SPACES):
        s = re.escape(sign)
        is_grouped = pc.match_substring_regex(
            bare, rf"^[-+]?\d{{1,3}}(?:{s}\d{{3}})+(?:{re.escape(decimal)}\d*)?{EXPONENT}$"
        )
        if pc.any(is_grouped).as_py():
            bare = pc.if_else(is_grouped, pc.replace_substring(bare, sign, ""), bare)
    if pc.any(pc.match_substring(bare, other)).as_py():
        return None
    bare = pc.replace_substring_regex(bare, r"^\+", "")
    bare = pc.replace_substring_regex(bare, r"^(-?[\d.,]+)[dD]([-+]?\d+)$", r"\1e\2")  # as Fortran writes them
    bare = pc.replace_substring(bare, decimal, ".") if decimal != "." else bare
    bare = pc.if_else(pc.equal(bare, ""), None, bare)
    try:
        return bare.cast(pa.float64())
    except pa.ArrowException:
        return None
