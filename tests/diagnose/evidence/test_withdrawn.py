"""Effects that are withdrawn after the verdict."""

from graph_cases import named, nothing

from rtctl.diagnose.evidence.diagnosis import NAMED, NOTHING, UNNAMED
from rtctl.diagnose.evidence.prediction import predict
from rtctl.diagnose.evidence.withdrawn import borne_out, told
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.search.hypotheses import hypotheses


def test_effect_with_worse_prediction_is_withdrawn():
    d = named()
    assert borne_out(d.decided, d.heldout).verdict == NAMED
    worse = borne_out(d.decided, d.heldout._replace(gain=-5.0))
    assert worse.verdict == UNNAMED
    assert "predicted worse than without" in worse.why
    assert not worse.confidence


def test_effect_compatible_with_size_zero_is_withdrawn():
    d = named()
    like, base, best = d.found.like, d.found.base, d.decided.best
    offset = next(h for h in hypotheses(like.sim, base.model) if h.name == "drive.offset:amplifier")
    more = refit(like, best.space.add(offset))
    heldout, _ = predict(base, more)
    decided, again, _ = told(d.decided._replace(best=more), heldout, d.found)
    assert decided.best.names == best.names == again.fits[1].names
    assert decided.why == "without drive.offset:amplifier, the held-out rows are predicted as well"


def test_effects_supported_only_together_are_withdrawn():
    """Offset and spring of a nominal machine; the offset alone brings no evidence."""
    d = nothing()
    like, base = d.found.like, d.found.base
    names = ("drive.offset:motor", "load.spring:rod")
    space = base.space.add(*(next(h for h in hypotheses(like.sim, base.model) if h.name == name) for name in names))
    both = refit(like, space)
    heldout, _ = predict(base, both)
    decided, again, predictor = told(d.decided._replace(verdict=NAMED, best=both), heldout, d.found)
    assert decided.verdict == NOTHING
    assert decided.best is predictor is base
    assert again.fits[1].names == ()
    assert "whose size may be zero" in decided.why
