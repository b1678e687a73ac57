from functools import cache

import numpy as np
import pytest
from graph_cases import BELT, case_of, command, record

from rtctl.diagnose.likelihood.fits import prior, refit, relaxed
from rtctl.diagnose.likelihood.joint import together

FORCES = ("inertia", "mass", "dry", "viscous", "stiffness", "damping", "gain")


@cache
def base():
    """The base fit of a belt axis that is as described."""
    like, space = together([record(case_of(BELT), command(0.6))])
    return refit(like, space)


def test_a_fit_goes_back_along_what_the_recording_does_not_tell():
    found = base()
    forces = [i for i, name in enumerate(found.space.names) if name.endswith(FORCES)]
    x = found.x.copy()
    x[forces] = 0.07  # all forces and inertias: no position shows it
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
