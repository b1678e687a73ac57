"""Every row of the thesis in its short version, and every figure."""

import re
from functools import cache

import pytest
from marks import long_where

from rtctl.config.errors import UserError
from rtctl.reproduce import figures, rows, run

PARTS = run.parts()
NAMES = [(i, row.name) for i, part in enumerate(PARTS) for row in part.rows]
FIGURES = [(i, number) for i, part in enumerate(PARTS) for number in part.figures]
LONG = ("3", "11", "12")  # chapters whose experiments run for more than 20 s


def is_long(row: str | tuple[int, str]) -> bool:
    """Whether a row or figure, or (part, row), is of a chapter of LONG."""
    name = row if isinstance(row, str) else row[1]
    return name.partition(".")[0] in LONG


WANTED = (
    "3.1 4.2 4.3 5.2 6.1 6.2 7.4 8.2 8.3 8.4 8.5 8.6 9.1 9.2 11.2 11.3 11.4 11.5 11.6 11.7 11.8 11.9 11.10 11.11 "
    "12.2 12.3 12.4 12.5 12.6 12.8 12.9 12.11 12.12"
)


@cache
def played(i: int) -> dict[str, rows.Row]:
    return {row.name: row for row in rows.measured(PARTS[i], short=True)}


@cache
def drawn(i: int, number: str) -> rows.Picture:
    return PARTS[i].figures[number](True)


@pytest.mark.parametrize(("i", "name"), long_where(is_long, NAMES), ids=[name for _, name in NAMES])
def test_row_has_the_expected_verdict(i, name):
    row = played(i)[name]
    assert row.verdict != "fail", (
        row.refused or f"{row.measured:.5g} {row.unit}, against {row.against:g} within {row.margin:.3g}"
    )


@pytest.mark.parametrize(("i", "number"), long_where(is_long, FIGURES), ids=[number for _, number in FIGURES])
def test_figure_is_drawn(i, number, tmp_path):
    picture = drawn(i, number)
    assert picture.number == number
    assert picture.sentence.endswith(".") and not re.search(r"\bnan\b", picture.sentence)
    assert all(axes.lines for axes in picture.figure.axes)
    assert 2_000 < figures.save(picture.figure, tmp_path, number).stat().st_size < 60_000


def test_all_rows_and_figures_exist():
    names = [name for _, name in NAMES]
    assert len(set(names)) == len(names) >= 40
    assert {int(name.partition(".")[0]) for name in names} == set(run.MODULES)
    assert sorted(number for _, number in FIGURES) == sorted(WANTED.split())


CORRECTED = {  # verdict and measured value of rows corrected after the first version
    "5.process_gain": ("erratum", 64.0),
    "5.bandwidth_high": ("erratum", 3.64),
    "5.phase_margin_empty": ("erratum", 68.4),  # parameter set as listed; 56 deg belong to another J_m
    "5.phase_margin_empty_heavy": ("differs", 55.8),
    "6.overshoot": ("differs", 1.18),  # mm, with the 500 increments of the text; the camera has 0.5 mm
    "6.overshoot_10000": ("differs", 0.70),
    "6.tension_moving": ("differs", 0.245),
    "6.tension_moving_10000": ("chosen", 0.1),
    "7.sensing_resistor": ("chosen", 0.24),
    "7.error_capacitor": ("chosen", 6.6),
    "7.error_resistor": ("chosen", 170.0),
    "7.slip_torque": ("erratum", 3.0),
    "7.motor_constant": ("erratum", 4790.0),
    "8.m_1": ("erratum", 0.206),
    "8.m_2": ("erratum", 16.6),
    "8.mode_tape": ("pass", 1.88),  # frequency of the rising gain, not of the mode at 2.55 Hz
    "8.mode_shaft": ("pass", 40.6),  # damped, not |lambda| = 41.6
    "8.hump_shaft": ("pass", 39.7),
    "8.bandwidth": ("pass", 0.595),  # as printed
    "8.stable": ("pass", 1.18),
    "8.gain_margin_40_40": ("pass", 1.18),
    "8.step_error_1": ("differs", 11.6),  # printed law, tape without compression
    "8.step_error_2": ("pass", 11.3),
    "8.accuracy": ("differs", 0.145),
    "8.accuracy_printed": ("erratum", 0.1325),
    "8.overshoot_second": ("differs", 0.63),
    "8.error_second": ("differs", 1.05),
    "8.overshoot_under": ("differs", 0.97),
    "9.gain_margin_fixed": ("pass", 1.18),
    "9.accuracy_fixed": ("pass", 0.2),  # mm, worst of five pairs of radii
    "9.accuracy": ("pass", 0.286),
    "9.error": ("differs", 1.43),
    "11.peak_150": ("chosen", 150.0),
    "12.k_s": ("erratum", 557.0),
    "12.k_c": ("erratum", 891.0),
    "12.J_c": ("erratum", 0.01),
    "12.J_t": ("erratum", 20.0),
    "12.process_gain": ("pass", 2.97),  # against the same mass
    "12.optimum_R_c": ("differs", 5.73),
    "12.optimum_R_t": ("differs", 19.2),
    "12.normal_force": ("chosen", 125.0),
    "12.present_bandwidth": ("chosen", 8.2),
    "12.notches": ("differs", 1.0),
}


@pytest.mark.parametrize("name", long_where(is_long, CORRECTED))
def test_corrected_row_keeps_its_verdict_and_value(name):
    (i,) = (i for i, row in NAMES if row == name)
    row = played(i)[name]
    assert (row.verdict, row.measured) == (CORRECTED[name][0], pytest.approx(CORRECTED[name][1], rel=0.02))


def test_error_of_a_step_depends_on_law_and_tape():
    """All rows use the printed law and a tape without compression. The remark lists three other combinations."""
    from rtctl.reproduce import chapter08 as ch

    def errors(printed: bool, slack: bool) -> list[float]:
        return ch.errors(ch.steps.steps(ch.radian(ch.TAU_C, printed, slack)))

    assert errors(True, False) == pytest.approx([3.4, 11.9], abs=0.06)
    assert errors(False, True) == pytest.approx([12.2, 7.5], abs=0.06)
    assert errors(False, False) == pytest.approx([2.8, 1.3], abs=0.06)
    pushed, slack = (ch.radian(ch.TAU_C, slack=s) for s in (False, True))
    assert min(pushed["truth_tension1"].min(), pushed["truth_tension2"].min()) < -0.2
    assert min(slack["truth_tension1"].min(), slack["truth_tension2"].min()) > -1e-9


def test_captions_name_the_differences_from_the_thesis_figure():
    said = {
        "5.2": "with the identified J_m", "6.2": "in place of the 500", "8.2": "five times the printed gains",
        "8.4": "chosen here", "8.6": "the law as printed", "11.7": "does not show 150 and 300 mm as two peaks",
        "11.9": "are weak", "12.2": "chosen here", "12.4": "In place of the block diagram",
        "12.5": "are not in this set", "12.8": "chosen here", "12.9": "One of the two notches",
    }  # fmt: skip
    for i, number in FIGURES:
        if number in said:
            assert said[number] in drawn(i, number).sentence, number


def test_wide_tolerance_has_a_reason():
    for part in PARTS:
        for row in part.rows:
            if row.bound == "within" and row.margin > 0.1 * abs(row.against) * (1 + 1e-9) and row.against:
                assert row.remark or row.differs, row.name
            assert (row.thesis is None or row.erratum or row.expected is None) and row.source and row.quantity


def test_only_selects_chapters_rows_and_figures():
    assert {part.chapter for part in run.parts("9")} == {9}
    (part,) = run.parts("8.delay")
    assert [row.name for row in part.rows] == ["8.delay"]
    assert run.parts("trend")[0].rows[0].name == "11.trend"
    assert "11.10" in run.parts("11.10")[0].figures
    with pytest.raises(UserError, match=r"--only 8\.dely: no such chapter, row or figure; did you mean '8\.delay'"):
        run.parts("8.dely")
    with pytest.raises(UserError, match="chapters 3, 4, 5"):
        run.parts("13")


def test_parts_run_in_order_with_a_progress_message(tmp_path):
    said: list[str] = []
    which = run.parts("7")
    results = run.reproduce(which, True, tmp_path, say=said.append)
    assert [result.title for result in results] == [part.title for part in which]
    assert said[0].startswith("[1/2] chapter 7, motor driver: 7 rows as stated (")
    assert [one.file for result in results for one in result.figures] == ["figure_7_4.png"]
    assert (tmp_path / run.FOLDER / "figure_7_4.png").is_file()


def test_parallel_run_gives_equal_rows(tmp_path):
    which = [run.parts("7.oscillator")[0], run.parts("12.notch")[0]]
    one, two = (run.reproduce(which, True, None, jobs) for jobs in (1, 2))
    assert [result.rows for result in one] == [result.rows for result in two]
