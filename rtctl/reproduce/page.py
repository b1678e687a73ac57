"""The page: one table a chapter, thesis beside measured, what is to be said of the rows, and the figures."""

import textwrap
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from rtctl.config.files import write_text
from rtctl.reproduce.rows import Row
from rtctl.reproduce.run import FOLDER, Result

PAGE = "reproduction.md"
WIDTH = 120
TITLES = {
    4: "Chapter 4: modelling",
    5: "Chapter 5: controller design",
    6: "Chapter 6: simulation",
    7: "Chapter 7: practical setup",
    8: "Chapter 8: test results",
    9: "Chapter 9: recommendations",
    10: "Chapter 10: printing steps",
    11: "Chapter 11: measurement error",
    12: "Chapter 12: performance",
}
HEAD = """# The thesis done again

The experiments and designs of *Motion Control of Industrial Printers*, played on the emulated machines and computed on
their models by `rtctl reproduce`, which wrote this page.

{words}

```bash
rtctl reproduce                  # all of it, with the figures, into docs/
rtctl reproduce --only 8         # one chapter, one row or one figure
rtctl reproduce --json           # the rows for a program
```

A row passes where the measured number is within the tolerance of the thesis's, or above or below it where it says so.
Where the thesis contradicts its own equations (erratum) the row is held against the number that the equations give.
A row without a number in the text is held against what the text claims, in parentheses.

The emulated machines have the parameters of the thesis. So a row that identifies one of them shows that the experiment
finds what is there; it does not show again what the real machines had.
"""
COLUMNS = ("name", "quantity", "thesis", "measured", "tolerance", "", "source")


def write(results: Sequence[Result], out: Path) -> Path:
    """Write the page into the folder `out` and return its path. Raises OSError where that cannot be."""
    path = out / PAGE
    write_text(path, text(results))
    return path


def text(results: Sequence[Result]) -> str:
    """The page of these results."""
    parts = [HEAD.format(words=summary([row for result in results for row in result.rows]))]
    for chapter, group in groupby(results, key=lambda result: result.chapter):
        parts.append(_chapter(chapter, list(group)))
    return "\n".join(parts)


def summary(rows: Sequence[Row]) -> str:
    """How many rows pass and how many are errata, in a sentence."""
    bad = [row.name for row in rows if not row.passes]
    errata = sum(bool(row.erratum) for row in rows)
    said = f"{len(rows) - len(bad)} of {len(rows)} rows pass; {errata} of them show an erratum of the thesis."
    return said + (f" Failing: {', '.join(bad)}." if bad else "")


def _chapter(chapter: int, results: Sequence[Result]) -> str:
    rows = [row for result in results for row in result.rows]
    lines = [f"## {TITLES[chapter]}", "", f"| {' | '.join(COLUMNS)} |", "|---|---|---:|---:|---|---|---|"]
    lines += [f"| {' | '.join(_cells(row))} |" for row in rows]
    notes = [_wrapped(f"- `{row.name}`: {note}", "  ") for row in rows if (note := _note(row))]
    lines += ["", *notes] if notes else []
    figures = sorted((one for result in results for one in result.figures), key=lambda one: _order(one.number))
    for one in figures:
        lines += [
            "",
            f"![Figure {one.number}]({FOLDER}/{one.file})",
            "",
            _wrapped(f"Figure {one.number}. {one.sentence}"),
        ]
    return "\n".join([*lines, ""])


def _cells(row: Row) -> list[str]:
    thesis = "-" if row.thesis is None else value(row.thesis, row.unit)
    if row.erratum:
        thesis += f", erratum: {value(row.against, row.unit)}"
    elif row.thesis is None:
        thesis = f"({value(row.against, row.unit)})"
    measured = "-" if row.refused else value(row.measured, row.unit)
    mark = "pass" if row.passes else "**fail**"
    cells = [f"`{row.name}`", row.quantity, thesis, measured, tolerance(row), mark, row.source]
    return [cell.replace("|", "\\|") for cell in cells]


def _note(row: Row) -> str:
    said = [f"erratum, {row.erratum}" if row.erratum else "", row.remark]
    said.append(f"not measured, {row.refused}" if row.refused else "")
    return "; ".join(part for part in said if part)


def value(x: float, unit: str) -> str:
    """A number with its unit, to four digits."""
    number = f"{x:.4g}" if x == 0 or 1e-3 <= abs(x) < 1e5 else f"{x:.3g}"
    return f"{number} {unit}".rstrip()


def tolerance(row: Row) -> str:
    """The tolerance in words: 3 %, 0.5 Hz, at least, at most."""
    size = ""
    if row.tolerance:
        size = f"{100 * row.tolerance:g} %" if row.relative else value(row.tolerance, row.unit)
    if row.bound == "within":
        return size or "exact"
    return row.bound + (f", less {size}" if size and row.bound == "at least" else f", and {size}" if size else "")


def _wrapped(words: str, indent: str = "") -> str:
    return "\n".join(textwrap.wrap(words, WIDTH, subsequent_indent=indent, break_on_hyphens=False))


def _order(number: str) -> tuple[int, ...]:
    return tuple(int(part) for part in number.split("."))
