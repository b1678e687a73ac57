"""Every row of the thesis in its short version, and every figure."""

import re
from functools import cache

import pytest

from rtctl.config.errors import UserError
from rtctl.reproduce import figures, rows, run

PARTS = run.parts()
NAMES = [(i, row.name) for i, part in enumerate(PARTS) for row in part.rows]
FIGURES = [(i, number) for i, part in enumerate(PARTS) for number in part.figures]
WANTED = (
    "4.2 4.3 5.2 6.1 6.2 7.4 8.2 8.3 8.4 8.5 8.6 11.2 11.3 11.4 11.5 11.6 11.7 11.8 11.9 11.10 "
    "12.2 12.3 12.4 12.5 12.6 12.8 12.9"
)


@cache
def played(i: int) -> dict[str, rows.Row]:
    return {row.name: row for row in rows.measured(PARTS[i], short=True)}


@pytest.mark.parametrize(("i", "name"), NAMES, ids=[name for _, name in NAMES])
def test_row(i, name):
    row = played(i)[name]
    assert row.passes, row.refused or f"{row.measured:.5g} {row.unit}, against {row.against:g} within {row.margin:.3g}"


@pytest.mark.parametrize(("i", "number"), FIGURES, ids=[number for _, number in FIGURES])
def test_figure(i, number, tmp_path):
    picture = PARTS[i].figures[number](True)
    assert picture.number == number
    assert picture.sentence.endswith(".") and not re.search(r"\bnan\b", picture.sentence)
    assert all(axes.lines for axes in picture.figure.axes)
    assert 2_000 < figures.save(picture.figure, tmp_path, number).stat().st_size < 60_000


def test_all_rows_and_figures_are_there():
    names = [name for _, name in NAMES]
    assert len(set(names)) == len(names) >= 40
    assert {int(name.partition(".")[0]) for name in names} == set(run.MODULES)
    assert sorted(number for _, number in FIGURES) == sorted(WANTED.split())


def test_wide_tolerances_say_why():
    for part in PARTS:
        for row in part.rows:
            if row.bound == "within" and row.margin > 0.1 * abs(row.against) * (1 + 1e-9) and row.against:
                assert row.remark, row.name
            assert (row.thesis is None or row.erratum or row.expected is None) and row.source and row.quantity


def test_only():
    assert {part.chapter for part in run.parts("9")} == {9}
    (part,) = run.parts("8.delay")
    assert [row.name for row in part.rows] == ["8.delay"]
    assert run.parts("trend")[0].rows[0].name == "11.trend"
    assert "11.10" in run.parts("11.10")[0].figures
    with pytest.raises(UserError, match=r"--only 8\.dely: no such chapter, row or figure; did you mean '8\.delay'"):
        run.parts("8.dely")
    with pytest.raises(UserError, match="chapters 4, 5, 6"):
        run.parts("13")


def test_parts_are_played_in_order_with_a_word_each(tmp_path):
    said: list[str] = []
    which = run.parts("7")
    results = run.reproduce(which, True, tmp_path, say=said.append)
    assert [result.title for result in results] == [part.title for part in which]
    assert said[0].startswith("[1/2] chapter 7, motor driver: 7 rows pass (")
    assert [one.file for result in results for one in result.figures] == ["figure_7_4.png"]
    assert (tmp_path / run.FOLDER / "figure_7_4.png").is_file()


def test_side_by_side_is_the_same(tmp_path):
    which = [run.parts("7.oscillator")[0], run.parts("12.notch")[0]]
    one, two = (run.reproduce(which, True, None, jobs) for jobs in (1, 2))
    assert [result.rows for result in one] == [result.rows for result in two]
