"""Message before the search of an effect."""

from graph_cases import BELT, RUB, case_of, command, record

from rtctl.cli.diagnose_console import FIRST
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.first_look import WORD, first_look


def look(terms):
    return first_look(refit(*together([record(case_of(BELT), command(0.6), terms)])))


def test_first_look_reports_a_missing_effect():
    assert "something is missing: the residual of encoder" in look([RUB])


def test_first_look_reports_a_residual_at_the_noise_level():
    assert "down to noise" in look([])


def test_console_prefix_matches_the_first_look():
    assert FIRST == WORD
