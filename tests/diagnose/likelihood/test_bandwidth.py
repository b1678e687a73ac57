from copy import copy
from functools import cache

import numpy as np
import pytest
from graph_cases import PENDULUM, case_of, command, named, nothing, record
from marks import full

from rtctl.diagnose.likelihood.bandwidth import lags, quicker
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.search.search import search

FINE = {**PENDULUM, "sensors": {"encoder": {**PENDULUM["sensors"]["encoder"], "counts_per_unit": 1e6}}}


@cache
def pushed(machine_is_fine):
    """Fit of a pendulum under a random-walk force."""
    u = command(4.0)
    wander = 0.05 * np.cumsum(np.random.default_rng(2).standard_normal(len(u))) / np.sqrt(len(u))
    like, space = together([record(case_of(FINE if machine_is_fine else PENDULUM), u, push=wander)])
    return refit(like, space)


def test_fine_sensor_under_a_random_walk_force_gets_a_faster_observer():
    assert quicker(pushed(True)) >= 2.0


def test_coarse_sensor_keeps_the_default_observer():
    assert lags(pushed(True)) and not lags(nothing().found.best)
    fit = pushed(True)
    coarse = fit._replace(like=copy(fit.like))
    coarse.like.least = fit.like.least * 1e6
    assert quicker(coarse) == 1.0


def test_nominal_machine_keeps_the_default_observer():
    assert quicker(nothing().found.best) == 1.0


def test_observer_bandwidth_is_limited_by_the_tick_rate():
    like = pushed(True).like
    sim = like.following(1e6).sim
    assert sim.follow == pytest.approx(0.25 / sim.record.dt)
    assert like.following(2.0).rows == like.rows


@full
def test_all_models_of_a_search_use_its_final_observer(monkeypatch):
    monkeypatch.setattr("rtctl.diagnose.search.search.quicker", lambda fit: 2.0)
    like, space = named().found.like, named().found.base.space
    found = search(like, space)
    assert found.base.like.sim.follow == pytest.approx(2.0 * like.sim.follow)
    assert {f.like.sim.follow for f in found.fits} == {found.base.like.sim.follow}
    assert found.best.names == ("friction.coulomb:carriage",)
