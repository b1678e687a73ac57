"""Every row names its inputs and quotes the named section of the thesis verbatim."""

import re
from functools import cache
from pathlib import Path

import pytest

from rtctl.reproduce import page, run

THESIS = Path(__file__).parents[2].parent / "shared" / "spec" / "thesis.txt"
HEADING = re.compile(r"^\s*#+ \**(?:Chapter (\d+)|(\d+\.\d+)(?:\.\d+)? |(Appendix [A-F]))", re.M)
ROWS = [row for part in run.parts() for row in part.rows]


def one_line(text: str) -> str:
    return " ".join(text.split())


@cache
def sections() -> dict[str, str]:
    """Text of the thesis by section, white space made single spaces: 9, 8.1, Appendix A."""
    if not THESIS.is_file():
        pytest.skip("the thesis is not here")
    text, found = THESIS.read_text(encoding="utf-8"), {}
    marks = list(HEADING.finditer(text))
    for mark, following in zip(marks, [*marks[1:], None], strict=True):
        name = next(group for group in mark.groups() if group)
        end = following.start() if following else len(text)
        found[name] = found.get(name, "") + " " + one_line(text[mark.start() : end])
    return found


@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_every_row_names_its_inputs(row):
    assert row.law and row.set and row.filter
    assert row.quote and "`" not in row.quote
    assert not (row.erratum and row.differs) and not (row.chosen and (row.erratum or row.differs))


@pytest.mark.parametrize("row", ROWS, ids=[row.name for row in ROWS])
def test_quote_is_in_the_named_section(row):
    section = row.source.split(",")[0]
    assert section in sections(), section
    assert one_line(row.quote) in sections()[section]


@pytest.mark.parametrize(("section", "quote", "right"), page.ERRATA)
def test_errata_without_a_number_are_quoted_on_the_page(section, quote, right):
    assert one_line(quote) in sections()[section] and right
    assert f"| {section} | `{one_line(quote)}` |" in page.text([])


def test_row_without_a_quote_has_no_thesis_value():
    """The thesis has no 6 dB for 38/22 mm and no error with a schedule."""
    for name in ("8.gain_margin_40_40", "8.gain_margin_40_20", "8.gain_margin_20_20", "9.gain_margin_fixed", "9.error"):
        (row,) = (row for row in ROWS if row.name == name)
        assert row.thesis is None and not row.erratum


@pytest.mark.parametrize(
    "name",
    ["7.sensing_resistor", "7.error_capacitor", "7.error_resistor", "12.normal_force", "12.present_bandwidth",
     "12.present_gain_margin", "12.gain_margin", "11.trend", "6.tension_moving_10000", "12.resonance_1"],
)  # fmt: skip
def test_inputs_chosen_to_match_the_thesis_value_are_marked(name):
    (row,) = (row for row in ROWS if row.name == name)
    assert row.chosen
