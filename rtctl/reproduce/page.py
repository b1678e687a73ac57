"""Reproduction page: one table for each chapter with thesis and measured values, notes on rows, and figures."""

import textwrap
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from rtctl.config.files import write_text
from rtctl.reproduce.rows import Row
from rtctl.reproduce.run import FOLDER, Result

PAGE = "reproduction.md"
WIDTH = 120
TITLES = {
    3: "Chapter 3: redesign concept",
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
A row without a number in the text is held against what the text claims, in parentheses.

- **erratum**: the thesis contradicts its own equations. The row is held against the number that the equations give.
- **chosen**: an input is not of the thesis. It was chosen here so that the number comes out.
- **differs**: the emulated machine does not give the number. The note says why.

The second table of a chapter says which law, which parameter set and which filter a row was computed with, and quotes
the text. What follows the name of a parameter set was put in here.

- `simulation` is that column of appendix A.
- `identified` is the other one, with R_c = 12.5 mm. Friction of 2.6 mNm at motor 2 and 0.1 mNm at the capstan is
  chosen here.
- `ivu-old` is the unit of chapter 2. Its torque, window, speed and radii are of the text; its motor, its camera and
  the guides of its path are chosen here.
- `appendix_f` is as listed, `figure_12_2` has k_s, k_c and M chosen here. The text has no damping; it is chosen here.

The emulated machines have these parameters. So a row that identifies one of them shows that the experiment finds what
is there; it does not show again what the real machines had.
"""
COLUMNS = ("name", "quantity", "thesis", "measured", "tolerance", "", "source")
WITH = ("name", "law", "parameter set", "filter", "text of the thesis")

ERRATA = (  # errata of the thesis without a number: section, printed words, correction
    ("12.1", r"-\frac{b_c + N^2b_m}{J_t}", "b_m is b_s, in appendix F too"),
    ("Appendix F", "0 & 1 & 0 & 0 & 0 & 0 & 0 & 0 & 0", "A, B and C have a ninth column for eight states"),
    ("Appendix A", "$c_{m1} = c_{m2}$	8.0e1	1.2e1	torsion spring constant motor shaft	[Nm]",
     "Nm/rad, and Nms/rad for the damping; in appendix F too"),
    ("7.2", r"f_0 = \sqrt{\frac{G_{mo} R_S}{R_F R_4 C_F C}}", "that is the angular frequency, 2 pi f_0"),
)  # fmt: skip


def write(results: Sequence[Result], out: Path) -> Path:
    """Write the page into the folder `out`; returns its path. Raises OSError where the write fails."""
    path = out / PAGE
    write_text(path, text(results))
    return path


def text(results: Sequence[Result]) -> str:
    """Markdown text of the page."""
    parts = [HEAD.format(words=_wrapped(summary([row for result in results for row in result.rows])))]
    for chapter, group in groupby(results, key=lambda result: result.chapter):
        parts.append(_chapter(chapter, list(group)))
    return "\n".join([*parts, *_errata()])


def summary(rows: Sequence[Row]) -> str:
    """Numbers of rows by verdict, in two sentences."""
    count = Counter(row.verdict for row in rows)
    bare, some = sum(row.thesis is None for row in rows), "row" if len(rows) == 1 else "rows"
    text = (
        f"{len(rows)} {some}: {count['pass']} agree with the thesis, {count['chosen']} by an input chosen here; "
        f"{count['erratum']} show an erratum of the thesis; in {count['differs']} the emulated machine differs. "
        f"The text has no number for {bare} of them, only a claim."
    )
    bad = [row.name for row in rows if row.verdict == "fail"]
    return text + (f" Failing: {', '.join(bad)}." if bad else "")


def _chapter(chapter: int, results: Sequence[Result]) -> str:
    rows = [row for result in results for row in result.rows]
    lines = [f"## {TITLES[chapter]}", "", f"| {' | '.join(COLUMNS)} |", "|---|---|---:|---:|---|---|---|"]
    lines += [f"| {' | '.join(_cells(row))} |" for row in rows]
    lines += ["", f"| {' | '.join(WITH)} |", "|---|---|---|---|---|"]
    lines += [f"| {' | '.join(_with(row))} |" for row in rows]
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


def _errata() -> list[str]:
    lines = ["## Errata without a number", "", "| section | text of the thesis | what is right |", "|---|---|---|"]
    return [*lines, *(f"| {section} | `{' '.join(quote.split())}` | {right} |" for section, quote, right in ERRATA), ""]


def _cells(row: Row) -> list[str]:
    thesis = "-" if row.thesis is None else value(row.thesis, row.unit)
    if row.erratum:
        thesis += f", erratum: {value(row.against, row.unit)}"
    elif row.thesis is None:
        thesis = f"({value(row.against, row.unit)})"
    measured = "-" if row.refused else value(row.measured, row.unit)
    mark = row.verdict if row.verdict == "pass" else f"**{row.verdict}**"
    cells = [f"`{row.name}`", row.quantity, thesis, measured, tolerance(row), mark, row.source]
    return [cell.replace("|", "\\|") for cell in cells]


def _with(row: Row) -> list[str]:
    cells = [f"`{row.name}`", row.law, row.set, row.filter, f"`{' '.join(row.quote.split())}`" if row.quote else ""]
    return [cell.replace("|", "\\|") for cell in cells]


def _note(row: Row) -> str:
    said = [f"erratum, {row.erratum}" if row.erratum else "", f"differs, {row.differs}" if row.differs else ""]
    said += [f"chosen here so that the row passes: {row.chosen}" if row.chosen else "", row.remark]
    said.append(f"not measured, {row.refused}" if row.refused else "")
    return "; ".join(part for part in said if part)


def value(x: float, unit: str) -> str:
    """Text of a number with unit, to four digits."""
    number = f"{x:.4g}" if x == 0 or 1e-3 <= abs(x) < 1e5 else f"{x:.3g}"
    return f"{number} {unit}".rstrip()


def tolerance(row: Row) -> str:
    """Text of the tolerance: 3 %, 0.5 Hz, at least, at most."""
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
