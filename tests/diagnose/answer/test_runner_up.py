"""Log-likelihood difference of the second most probable answer, per segment."""

import numpy as np
import pytest
from graph_cases import named, nothing, unnamed

from rtctl.diagnose.answer.report import html
from rtctl.diagnose.answer.runner_up import Lost, answers, lost_by, runs, sentence, when
from rtctl.diagnose.evidence.evidence import SEGMENTS


@pytest.mark.parametrize("d", [named, nothing, unnamed])
def test_runner_up_has_a_loss_in_every_segment(d):
    lost = lost_by(d())
    assert len(lost.nats) == SEGMENTS
    begin, end = d().found.like.rows
    np.testing.assert_allclose(lost.edges[[0, -1]], [begin * d().record.dt, end * d().record.dt])
    assert lost.behind > 0.0
    assert sentence(d()).startswith(f"The next likeliest answer is {lost.other}.")


def test_segment_losses_sum_to_the_log_likelihood_difference():
    """For models without a free function, each under its own noise model."""
    d = named()
    pairs = [(r.fit, r.free) for r in d.decided.table if r.free is None]
    lost = lost_by(d)
    gaps = [
        float(d.found.base.power * (fit.like.loss(fit.e) - d.decided.best.like.loss(d.decided.best.e)))
        for fit, _ in pairs
    ]
    assert min(abs(lost.nats.sum() - gap) for gap in gaps) < 1e-3


@pytest.mark.parametrize(("verdict", "d"), [("named", named), ("nothing", nothing), ("unnamed", unnamed)])
def test_answer_among_the_rivals_matches_the_verdict(verdict, d):
    from rtctl.diagnose.answer.posterior import rivals

    own = next(bar for bar in rivals(d()) if answers(d(), bar))
    assert bool(own.free) == (verdict == "unnamed")
    if verdict != "unnamed":
        assert own.names == {"named": ("friction.coulomb:carriage",), "nothing": ()}[verdict]


def test_sentence_names_the_decisive_rows():
    edges = np.arange(9.0)
    here = Lost("x", 0.0, 30.0, edges, np.array([0.0, 0.0, 10.0, 12.0, 0.5, 0.0, 8.0, 0.0]))
    assert when(here, 1) == "Half of the evidence against it is in the rows from 2 to 4 s."
    even = here._replace(nats=np.full(8, 0.01))
    assert "do not decide" in when(even, 1)
    spread = here._replace(nats=np.array([5.0, 0.0, 5.0, 0.0, 5.0, 0.0, 5.0, 0.0]) + np.array([5.0, 0.0] * 4))
    assert when(spread, 1) == "Half of the evidence against it is in the rows from 0 to 1 s and 2 to 3 s."
    assert when(here, 2) == ""


def test_adjacent_segments_form_one_run():
    assert runs(np.array([1, 2, 3, 7, 9, 10])) == [(1, 3), (7, 7), (9, 10)]


def test_report_explains_the_runner_up():
    page = html(unnamed())
    assert "The next likeliest answer is" in page
    assert "Gain in log probability of the answer over the next likeliest one" in page


def test_report_omits_the_segment_figure_without_evidence():
    assert not lost_by(named()).nats.any()
    page = html(named())
    assert "The rows do not decide between the two" in page
    assert "Gain in log probability of the answer over the next likeliest one" not in page
