from functools import cache

import numpy as np
import pytest
from graph_cases import BELT, RUB, case_of, command, record

from rtctl.diagnose.likelihood.descent import ALL, EFFECTS, Point
from rtctl.diagnose.likelihood.fits import evaluated, finished, prior, refit, relaxed
from rtctl.diagnose.likelihood.inexact import errors
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.model.space import SIZE, Coordinate, Hypothesis

DRY = Hypothesis("friction.coulomb", "carriage", (Coordinate("F_C", SIZE, 1.0),))
FORCES = ("inertia", "mass", "dry", "viscous", "stiffness", "damping", "gain")


@cache
def base():
    """Base fit of a nominal belt axis."""
    like, space = together([record(case_of(BELT), command(0.6))])
    return refit(like, space)


def test_relaxed_fit_returns_to_the_prior_along_unobservable_directions():
    found = base()
    forces = [i for i, name in enumerate(found.space.names) if name.endswith(FORCES)]
    x = found.x.copy()
    x[forces] = 0.07  # common factor of all forces and inertias: unobservable in positions
    e = found.like.raw(found.space.model(x))
    strayed = found._replace(x=x, e=e, loss=found.like.loss(e))
    assert strayed.loss == pytest.approx(found.loss, abs=8.0)
    back = relaxed(strayed)
    assert back.log_evidence > strayed.log_evidence + 1.0
    assert np.abs(back.x[forces]).max() < 0.04


def test_every_unknown_has_a_prior():
    weight = prior(base().space)
    assert (weight > 0.0).all()
    assert np.isfinite(base().log_evidence)


@cache
def draft():
    """Base and draft fit of dry friction, for a belt axis with extra dry friction."""
    like, space = together([record(case_of(BELT), command(0.6), [RUB])])
    alone = refit(like, space)
    return alone, refit(like, space.add(DRY), np.append(alone.x, 1.0), alone.J, draft=True)


def test_finished_draft_has_the_evidence_of_a_full_fit():
    alone, rough = draft()
    whole = refit(alone.like, rough.space, np.append(alone.x, 1.0), alone.J, relax=False)
    done = finished(rough)
    assert (rough.fresh, done.fresh, whole.fresh) == (EFFECTS, ALL, ALL)
    assert done.log_evidence == pytest.approx(whole.log_evidence, abs=3.0)
    assert alone.log_evidence + 100.0 < rough.log_evidence < done.log_evidence + 3.0
    assert finished(done) is done


def test_evaluation_of_a_model_does_not_depend_on_the_initial_noise_model():
    alone, rough = draft()
    at = Point(rough.x, rough.e, rough.J)
    loud = evaluated(alone.like, rough.space, at)  # noise model without the effect
    quiet = evaluated(rough.like, rough.space, at)
    assert loud.loss == pytest.approx(quiet.loss, abs=1e-6)
    assert loud.log_evidence == pytest.approx(quiet.log_evidence, abs=1e-6)


def test_exact_law_gets_a_smaller_law_error_than_an_approximate_law():
    _, rough = draft()
    exact = finished(rough)
    u = command(0.6)
    stribeck = {"term": "friction.stribeck", "node": "carriage", "F_s": 3.2, "v_s": 0.1}
    like, space = together([record(case_of(BELT), u, [RUB, stribeck])])
    alone = refit(like, space)
    about = refit(like, space.add(DRY), np.append(alone.x, 1.0), alone.J)

    def share(f):
        """Ratio of the fitted law error to the default law error."""
        return np.std(f.like.errors) / np.std(errors(f.like, f.space, f.x, f.e).laws)

    assert share(exact) < 0.2 * share(about)
    usual = exact.like.slackened(errors(exact.like, exact.space, exact.x, exact.e).laws).told(exact.e)
    assert exact.loss < usual.loss(exact.e) - 5.0
