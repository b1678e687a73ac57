import io
import re

import numpy as np
import pytest
from graph_cases import named, nothing, unnamed
from rich.console import Console

from rtctl.diagnose.answer import report
from rtctl.diagnose.answer.missing_force import Missing, subjects
from rtctl.diagnose.answer.posterior import rivals


def said(d, width=110):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(report.terminal(d))
    return console.export_text()


def test_page_of_a_named_effect_is_self_contained():
    page = report.html(named())
    assert "The carriage rubs" in page
    assert not re.search(r'(src|href)="(?!#)', page)
    assert "<script" not in page
    assert page.count("<svg") == 4
    assert "friction.coulomb" in page
    assert "spring balance" in page  # check for the mechanic
    assert "prefers-color-scheme: dark" in page


@pytest.mark.parametrize(
    ("d", "words"), [(nothing, "What is missing: no force with a pattern"), (unnamed, "Record this instead")]
)
def test_page_of_a_verdict_without_a_name(d, words):
    assert words in report.html(d())


def test_fitted_law_matches_the_missing_force():
    runs = Missing(named())
    assert subjects(named()) == [("friction.coulomb", "carriage", "velocity")]
    curve = runs.of("friction.coulomb", "carriage", "velocity")
    fast = np.abs(curve.x) > 0.05
    fast[: runs.rows.start] = False
    ahead = fast & (curve.x > 0)
    np.testing.assert_allclose(np.median(curve.law[ahead]), -2.0, rtol=0.3)  # the description also has friction
    np.testing.assert_allclose(np.median(curve.y[ahead]), np.median(curve.law[ahead]), rtol=0.1)
    assert (curve.x_unit, curve.y_unit) == ("m/s", "N")


def test_rival_probabilities_including_the_free_force_sum_to_one():
    for d in (nothing(), named(), unnamed()):
        bars = rivals(d)
        assert sum(b.probability for b in bars) == pytest.approx(1.0)
        assert any(b.names == () and not b.free for b in bars)
    assert any(b.free for b in rivals(unnamed()))
    assert rivals(named())[0].names == ("friction.coulomb:carriage",)


def test_uninformed_parameters_are_marked():
    rows = {row.path: row for row in report.parameter_rows(named())}
    assert set(rows) == set(named().parameters)
    assert not rows["drives.amplifier.gain"].untold
    assert any(row.untold for row in rows.values())


def test_terminal_shows_verdict_size_and_held_out_error():
    text = said(named())
    assert "named" in text
    assert "F_C" in text
    assert "Error on rows that were not fitted" in text
    assert "The verdict is unnamed" in said(unnamed())


def test_terminal_does_not_wrap_an_effect_name():
    assert "(friction.coulomb)" in said(named(), 80)


def test_rejected_models_are_named_in_words():
    text = report.told_names(unnamed(), "beside friction.coulomb:carriage, a wrong drives.motor.gain at time:12 s")
    assert text == "beside dry friction at the carriage, a wrong drives.motor.gain at time:12 s"
