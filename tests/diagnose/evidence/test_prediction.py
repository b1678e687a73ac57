import numpy as np
from graph_cases import BELT, RUB, case_of, command, named, record

from rtctl.diagnose.evidence.diagnosis import NAMED
from rtctl.diagnose.evidence.prediction import ahead, predict
from rtctl.diagnose.evidence.verdict import fewer
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.hypotheses import hypotheses


def with_gust():
    """Fits of a belt axis with dry friction of the carriage and a motor torque that ends before the last part.

    Returns the base and a model with dry friction and an amplifier offset.
    """
    u = command(0.9)
    gust = np.where(np.arange(len(u)) < 0.7 * len(u), 0.02, 0.0)
    like, space = together([record(case_of(BELT), u, [RUB | {"F_C": 4.0}], push=gust)])
    base = refit(like, space)
    wanted = ("friction.coulomb:carriage", "drive.offset:amplifier")
    for name in wanted:
        space = space.add(next(h for h in hypotheses(like.sim, base.model) if h.name == name))
    return base, refit(like, space)


def test_only_the_effect_with_worse_prediction_is_removed():
    base, both = with_gust()
    heldout, best = predict(base, both, True)
    assert best.names == ("friction.coulomb:carriage",)
    assert heldout.fits[1].names == best.names
    assert heldout.after < heldout.before


def test_prediction_without_removal_keeps_all_effects():
    base, both = with_gust()
    heldout, best = predict(base, both)
    assert best is both
    assert heldout.fits[1].names == both.names


def test_verdict_names_the_removed_effect():
    d = named()
    best = d.decided.best
    more = best._replace(space=best.space.add(best.space.hypotheses[0]._replace(node="motor")))
    found = fewer(d.decided._replace(best=more), best, "the held-out rows are predicted better")
    assert (found.verdict, found.best.names) == (NAMED, best.names)
    assert found.why == "without friction.coulomb:motor, the held-out rows are predicted better"
    assert len(found.confidence) == 1
    assert fewer(d.decided, best, "") is d.decided


def test_nearer_model_is_ahead_of_a_model_with_larger_expected_noise():
    heldout = named().heldout
    base, best = heldout.fits
    loud = best._replace(like=best.like.flat(base.e))  # noise level of the base
    lone, both, deaf = ((f, heldout.late.raw(f.model)) for f in (base, best, loud))
    assert ahead(heldout.late, both, lone) > 100.0
    assert ahead(heldout.late, lone, both) < -100.0
    assert ahead(heldout.late, both, deaf) == heldout.late.foretold(
        heldout.late.raw(best.model), loud.like
    ) - heldout.late.foretold(heldout.late.raw(best.model), best.like)
