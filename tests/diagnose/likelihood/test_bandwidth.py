from copy import copy
from functools import cache

import numpy as np
import pytest
from graph_cases import PENDULUM, case_of, command, named, nothing, record

from rtctl.diagnose.likelihood.bandwidth import lags, quicker
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.search import search

FINE = {**PENDULUM, "sensors": {"encoder": {**PENDULUM["sensors"]["encoder"], "counts_per_unit": 1e6}}}


@cache
def pushed(machine_is_fine):
    """Fit of a pendulum on which a force acts that wanders at random."""
    u = command(4.0)
    wander = 0.05 * np.cumsum(np.random.default_rng(2).standard_normal(len(u))) / np.sqrt(len(u))
    like, space = together([record(case_of(FINE if machine_is_fine else PENDULUM), u, push=wander)])
    return refit(like, space)


def test_a_fine_sensor_beside_a_force_that_wanders_is_followed_more_quickly():
    assert quicker(pushed(True)) >= 2.0


def test_what_only_counts_is_not_followed_more_quickly():
    assert lags(pushed(True)) and not lags(nothing().found.best)
    fit = pushed(True)
    coarse = fit._replace(like=copy(fit.like))
    coarse.like.least = fit.like.least * 1e6
    assert quicker(coarse) == 1.0


def test_a_machine_as_described_is_followed_as_usual():
    assert quicker(nothing().found.best) == 1.0


def test_no_observer_is_quicker_than_the_ticks():
    like = pushed(True).like
    sim = like.following(1e6).sim
    assert sim.follow == pytest.approx(0.25 / sim.record.dt)
    assert like.following(2.0).rows == like.rows


def test_all_models_of_a_search_have_the_observer_that_it_ends_with(monkeypatch):
    monkeypatch.setattr("rtctl.diagnose.search.search.quicker", lambda fit: 2.0)
    like, space = named().found.like, named().found.base.space
    found = search(like, space)
    assert found.base.like.sim.follow == pytest.approx(2.0 * like.sim.follow)
    assert {f.like.sim.follow for f in found.fits} == {found.base.like.sim.follow}
    assert found.best.names == ("friction.coulomb:carriage",)
