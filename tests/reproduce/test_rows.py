"""Verdict of a row: tolerance against the thesis value or against its equations."""

import math

import pytest

from rtctl.config.errors import NoAnswer
from rtctl.reproduce.rows import NONE, Part, Row, measured, under

ROW = Row("8.delay", "delay", "(8.2)", 3.0, "ms", 0.03)


@pytest.mark.parametrize(
    ("row", "good", "bad"),
    [
        (ROW, (3.0, 2.92, 3.08), (2.9, 3.1, math.nan, math.inf)),
        (ROW._replace(relative=False), (2.975, 3.025), (2.96, 3.04)),
        (ROW._replace(bound="at least"), (2.92, 30.0), (2.9, math.nan)),
        (ROW._replace(bound="at most"), (0.0, 3.08), (3.1, math.nan)),
        (ROW._replace(expected=6.0, erratum="a factor of 2"), (6.0, 5.83), (3.0,)),
        (ROW._replace(thesis=None, expected=-4.0), (-4.0, -4.1), (4.0,)),
        (ROW._replace(tolerance=0.0), (3.0,), (3.0001,)),
    ],
)
def test_row_passes_within_its_tolerance(row, good, bad):
    assert all(row._replace(measured=value).passes for value in good)
    assert not any(row._replace(measured=value).passes for value in bad)


@pytest.mark.parametrize(
    ("row", "measured", "verdict"),
    [
        (ROW, 3.0, "pass"),
        (ROW, 4.0, "fail"),
        (ROW, math.nan, "fail"),
        (ROW._replace(chosen="T_c = 2 ms"), 3.0, "chosen"),
        (ROW._replace(chosen="T_c = 2 ms"), 4.0, "fail"),
        (ROW._replace(erratum="a factor of 2", expected=6.0), 6.0, "erratum"),
        (ROW._replace(erratum="a factor of 2", expected=6.0), 3.0, "fail"),
        (ROW._replace(differs="friction"), 4.0, "differs"),
        (ROW._replace(differs="friction"), 3.0, "fail"),  # declared difference, but within the tolerance
        (ROW._replace(differs="friction"), math.nan, "fail"),
    ],
)
def test_verdict_of_a_row(row, measured, verdict):
    assert row._replace(measured=measured).verdict == verdict


def test_common_law_and_parameter_set_of_rows():
    own = ROW._replace(law="PD")
    made = under(ROW, own, law="none at all", set="identified")
    assert [(row.law, row.set, row.filter) for row in made] == [
        ("none at all", "identified", NONE),
        ("PD", "identified", NONE),
    ]


def test_json_names_the_reference_value():
    row = ROW._replace(expected=6.0, erratum="a factor of 2", measured=6.1)
    made = row.as_json()
    assert {"name", "source", "thesis", "measured", "tolerance", "pass", "erratum"} <= set(made)
    assert made["thesis"] == 3.0 and made["against"] == 6.0 and made["erratum"] == "a factor of 2"
    assert made["pass"] is (abs(made["measured"] - made["against"]) <= made["tolerance"]) is True
    assert {"law", "set", "filter", "quote", "chosen", "differs"} <= set(made) and made["verdict"] == "erratum"
    assert ROW.as_json()["measured"] is None and ROW.as_json()["erratum"] is None


def test_experiment_without_an_answer_fails_its_rows_with_a_reason():
    def play(short):
        raise NoAnswer("too short from 1 to 2 Hz")

    (row,) = measured(Part("delay", (ROW,), play), True)
    assert not row.passes
    assert row.as_json()["remark"] == "too short from 1 to 2 Hz"


def test_additional_measured_values_are_ignored():
    part = Part("delay", (ROW,), lambda short: {"8.delay": 3.01, "8.gain": 6.2})
    assert [row.measured for row in measured(part, True)] == [3.01]
    assert part.chapter == 8
