import numpy as np
import pytest
from graph_cases import BELT, RUB, case_of, command, record

from rtctl.diagnose.evidence.evidence import SEGMENTS, arguments, bagged, shares
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.hypotheses import hypotheses


def test_evidence_of_every_segment_gives_a_sure_posterior():
    losses = np.stack([np.full(SEGMENTS, 0.0), np.full(SEGMENTS, 1.0)])
    chances = bagged(-losses.sum(axis=1), losses)
    assert chances[0] > 0.999
    assert chances.sum() == pytest.approx(1.0)


def test_models_that_share_the_segments_get_about_equal_posteriors():
    losses = np.zeros((2, SEGMENTS))
    losses[0, ::2] = losses[1, 1::2] = 20.0
    losses[1, 0] += 3.0  # the posterior of the whole recording favours the first model
    merits = -losses.sum(axis=1)
    assert 1.0 / (1.0 + np.exp(merits[1] - merits[0])) > 0.95
    assert bagged(merits, losses)[0] == pytest.approx(0.5, abs=0.1)


def test_equal_segments_keep_the_posterior_of_the_whole_recording():
    merits = np.array([0.0, -1.0, -2.0])
    odds = np.exp(merits)
    np.testing.assert_allclose(bagged(merits, np.ones((3, SEGMENTS))), odds / odds.sum())


@pytest.mark.parametrize(
    ("terms", "axes"),
    [(["friction.coulomb"], {"velocity"}), (["load.gravity"], {"angle", "position"}),
     (["load.spring", "drive.deadband"], {"position", "command"}), ([], set())],
)  # fmt: skip
def test_law_error_depends_on_the_argument_of_the_law(terms, axes):
    assert set(arguments([(term, 1.0) for term in terms])) == axes


def test_law_error_of_a_resonance_does_not_depend_on_time():
    assert "time" not in arguments([("structure.resonance", 1.0)])


def test_law_error_is_proportional_to_the_effect():
    offset = {"term": "drive.offset", "node": "amplifier", "offset": 0.01}
    like, space = together([record(case_of(BELT), command(0.6), [RUB, offset])])
    base = refit(like, space)
    assert shares(base) == []
    for name in ("friction.coulomb:carriage", "drive.offset:amplifier"):
        space = space.add(next(h for h in hypotheses(like.sim, base.model) if h.name == name))
    told = dict(shares(refit(like, space)))
    assert told["friction.coulomb"] > 3.0 * told["drive.offset"]  # 2 N, and 2.5 mNm, which is 0.2 N
    assert np.hypot(*told.values()) == pytest.approx(1.0)
    assert arguments(list(told.items())) == {"velocity": told["friction.coulomb"], "command": told["drive.offset"]}
