"""The sentence that is told before any name is looked for."""

from graph_cases import BELT, RUB, case_of, command, record

from rtctl.cli.diagnose_console import FIRST
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.first_look import WORD, first_look


def look(terms):
    return first_look(refit(*together([record(case_of(BELT), command(0.6), terms)])))


def test_what_is_missing_shows_before_it_has_a_name():
    assert "something is missing: the residual of encoder" in look([RUB])


def test_a_description_that_is_right_leaves_noise():
    assert "down to noise" in look([])


def test_the_console_knows_how_it_begins():
    assert FIRST == WORD
