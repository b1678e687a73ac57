import numpy as np
import pytest
from graph_cases import BELT, RUB, case_of, command, record

from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.shares import shown
from rtctl.diagnose.search.hypotheses import hypotheses


@pytest.fixture(scope="module")
def pair():
    """Fits of the nominal belt axis and of the axis with dry friction to a recording with dry friction."""
    like, space = together([record(case_of(BELT), command(0.6), [RUB])])
    base = refit(like, space)
    name = "friction.coulomb:carriage"
    return base, refit(like, space.add(next(h for h in hypotheses(like.sim, base.model) if h.name == name)))


def test_true_effect_explains_the_missing_share(pair):
    assert shown(*pair) > 0.9


def test_model_with_the_residual_of_the_base_explains_nothing(pair):
    base, best = pair
    assert shown(base, base) == 0.0
    slightly = best._replace(e=base.e + 0.02 * (best.e - base.e), pushes=base.pushes)
    assert 0.0 < shown(base, slightly) < 0.1


def test_quantisation_noise_is_not_a_missing_share(pair):
    base, best = pair
    counted = np.full(base.e.shape, 1.0) * base.like.least * np.sqrt(base.like.mean)
    assert shown(base._replace(e=0.9 * counted), best._replace(e=0.8 * counted, pushes=base.pushes)) == 0.0
