"""Verdict from the probabilities of all rivals."""

import pytest
from graph_cases import BELT, RUB, case_of, command, record

from rtctl.diagnose.evidence.evidence import Rival, rivals
from rtctl.diagnose.evidence.verdict import nameless_best, robust
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.hypotheses import hypotheses
from rtctl.diagnose.search.search import Found

GAIN = "drives.amplifier.gain"
RUBS, DRAGS = "friction.coulomb:carriage", "friction.viscous:carriage"


@pytest.fixture(scope="module")
def fits():
    """Function (effect names, doubted parameter) -> fit of a belt axis with dry friction."""
    like, space = together([record(case_of(BELT), command(0.6), [RUB])])
    base = refit(like, space)
    known = {h.name: h for h in hypotheses(like.sim, base.model)}
    made = {(): base}

    def fit(*names, doubted=""):
        if names not in made:
            own = space
            for name in names:
                own = own.add(known[name])
            made[names] = refit(like, own)
        found = made[names]
        return found._replace(space=found.space._replace(doubted=doubted)) if doubted else found

    return fit


def listed(fit, probability):
    return Rival(fit, None, 0.0, probability)


def test_effect_with_and_without_a_doubted_parameter_is_robust(fits):
    with_number = listed(fits(RUBS, doubted=GAIN), 0.8)
    assert robust((with_number, listed(fits(RUBS, DRAGS), 0.2)), (RUBS, DRAGS)) == (RUBS,)
    assert (
        robust((with_number, listed(fits(DRAGS), 0.2)), (DRAGS,)) == ()
    )  # another effect without the doubted parameter


def test_effect_only_beside_a_doubted_parameter_is_not_robust(fits):
    assert robust((listed(fits(RUBS, doubted=GAIN), 0.99), listed(fits(RUBS), 0.01)), (RUBS,)) == ()


def test_unnamed_force_is_located_by_the_summed_probability(fits):
    found = fits()
    table = rivals(Found(found.like, found, (), (found,), 3.0))
    free = [r for r in table if r.free is not None and r.unlisted]
    assert len({(r.free.node, r.free.axis) for r in free}) > 1
    first = free[0].free
    other = next(r for r in free if (r.free.node, r.free.axis) != (first.node, first.axis))
    split = (free[0]._replace(probability=0.3, merit=1.0), free[0]._replace(probability=0.3, merit=2.0))
    best = nameless_best((*split, other._replace(probability=0.4, merit=9.0)))
    assert best is split[1]
    assert nameless_best((listed(found, 1.0),)) is None
