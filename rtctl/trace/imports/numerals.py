"""Numbers as text: the decimal sign of a whole file, and thousands that are grouped.

One decisive cell anywhere decides for the file: `0,5`, `12.25` and `1,234.5` can be read in one way only. `1,980` alone
cannot; where nothing else decides, it is refused.
"""

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from rtctl.config.errors import UserError

SPACES = " '\u2019\u00a0\u2009\u202f"  # further signs between thousands
EXPONENT = r"(?:[eEdD][-+]?\d+)?"


def _decides(sign: str, other: str) -> re.Pattern[str]:
    """Cells in which `sign` can only be the decimal sign."""
    s, o = re.escape(sign), re.escape(other)
    return re.compile(
        rf"[-+]?(?:\d*{s}(?:\d{{0,2}}|\d{{4,}})|0\d*{s}\d+|\d{{4,}}{s}\d+|{s}\d+|\d{{1,3}}(?:[{o}{SPACES}]\d{{3}})+{s}\d+)"
        rf"{EXPONENT}|[-+]?\d+{s}\d+[eEdD][-+]?\d+"
    )


DECIDES = {".": _decides(".", ","), ",": _decides(",", ".")}
GROUPED = re.compile(r"[-+]?\d{1,3}(?P<sign>[.,])\d{3}(?:(?P=sign)\d{3})*")
TWICE = re.compile(r"[-+]?\d{1,3}(?:(?P<sign>[.,])\d{3}){2,}")


def decimal_sign(path: Path, texts: Iterable[str], where: Callable[[str], str]) -> tuple[str, str | None]:
    """Decimal sign of a file by all its cells, and a sentence on what was assumed.

    `where(text)` names the first row with that cell. Raises UserError where the cells contradict each other, or leave
    the sign open.
    """
    found: dict[str, str] = {}
    open_: dict[str, str] = {}
    for text in texts:
        for sign in ".,":
            if sign not in found and DECIDES[sign].fullmatch(text):
                found[sign] = text
        if match := GROUPED.fullmatch(text):
            if TWICE.fullmatch(text):  # 1.234.567 groups by the dot
                found.setdefault("," if match["sign"] == "." else ".", text)
            open_.setdefault(match["sign"], text)
        if len(found) == 2:
            one, two = found["."], found[","]
            raise UserError(
                f"{path}: '{one}' ({where(one)}) has a decimal point and '{two}' ({where(two)}) a decimal comma; "
                "write one of them throughout"
            )
    if found:
        return next(iter(found)), None
    if open_:
        sign, text = next(iter(open_.items()))
        if len(open_) == 2:
            return ",", None  # never both decimal
        raise UserError(
            f"{path}: '{text}' ({where(text)}) is {text.replace(sign, '')} or {text.replace(sign, '.')}: nothing in the "
            f"file says whether '{sign}' groups thousands; --decimal {sign} if it is the decimal sign, "
            f"--decimal {'.' if sign == ',' else ','} if it groups"
        )
    return ".", None


def numbers(cells: np.ndarray, decimal: str) -> tuple[np.ndarray, int | None]:
    """Doubles (n,) of texts (n,), empty ones nan, and the first row that is no number (None: all are)."""
    other = "," if decimal == "." else "."
    grouped = re.compile(
        rf"[-+]?\d{{1,3}}([{re.escape(other)}{SPACES}])\d{{3}}(?:\1\d{{3}})*(?:{re.escape(decimal)}\d*)?{EXPONENT}"
    )
    out = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        text = "" if cell is None else str(cell).strip()
        if not text:
            continue
        if grouped.fullmatch(text):
            for sign in (other, *SPACES):
                text = text.replace(sign, "")
        elif other in text:
            return out, k
        try:
            out[k] = float(text.replace(decimal, ".").replace("D", "e").replace("d", "e"))
        except ValueError:
            return out, k
    return out, None
