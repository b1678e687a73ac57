"""Position-dependent loads: springs, cable chains, imbalance and bumps, with their energy balance."""

import math

import bench
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants.physics import load

M, K = 95.1, 35.15


def test_load_spring_settles_at_its_rest_position():
    term = bench.usual("load.spring", "axis", k=1e4, x0=1e-3)
    r = bench.run("axis", [term], np.zeros(8000), F_c=0.0, F_v=2e3)
    assert r.q[-1, 0] == pytest.approx(1e-3, rel=1e-3)


def test_load_spring_of_the_carriage_is_in_newtons_per_metre():
    term = bench.usual("load.spring", "ldu", k=2e3)
    r = bench.run("ldu", [term], np.linspace(0, 0.15, 2000), F_c=0.0, B_m=30.0)
    assert r.y[-1, 1] == pytest.approx(0.15 * 21e-3 * 20 / 3e-3 / 2e3, rel=0.03)


def test_cable_chain_has_hysteresis_on_reversal():
    p = load.build_cable_chain(load.CableChainSettings(node="carriage", k=20.0, F_h=2.0, z_h=2e-3), 1e-3)
    s = np.zeros(1, load.CABLE_CHAIN_STATE).view(np.recarray)[0]
    out = np.linspace(0, 0.1, 1001)
    there = [load.cable_chain(p, s, x) for x in out]
    back = [load.cable_chain(p, s, x) for x in out[::-1]]
    assert there[-1] == pytest.approx(-2.0 - 2.0)
    assert back[500] - there[500] == pytest.approx(4.0)  # twice the drag
    assert back[1] - there[-1] < 0.5  # not immediately
    assert np.trapezoid(there, out) - np.trapezoid(back[::-1], out) < 0.0  # a loop costs energy


@settings(deadline=None)
@given(st.floats(-10, 10), st.floats(-7, 7), st.floats(0.01, 10))
def test_imbalance_has_zero_mean_over_a_turn(A, phi, turn):
    p = load.build_imbalance(load.ImbalanceSettings(node="carriage", A=A, phi=phi, turn=turn), 1e-3)
    x = np.linspace(0, turn, 65)[:-1]
    force = np.array([load.imbalance(p, v) for v in x])
    assert abs(force.sum()) < 1e-9
    assert np.abs(force).max() <= abs(A)
    assert force[0] == pytest.approx(A * math.sin(phi))


def bump(form: str, **values) -> load.BumpSettings:
    return bench.usual("load.bump", "axis", form=form, at=0.02, width=2e-3, **values)


@pytest.mark.parametrize("v", [0.05, 0.2])
def test_hill_is_conservative_and_drag_is_dissipative(v):
    free = {"F_c": 0.0, "F_v": 0.0}
    hill = bench.run("axis", [bump("hill", F=20.0)], np.zeros(1000), speeds={"carriage": v}, **free)
    height = 20.0 * 2e-3 * math.sqrt(math.e)
    assert hill.v.min() == pytest.approx(math.sqrt(v**2 - 2 * height / M), rel=1e-3)
    assert hill.v[-1, 0] == pytest.approx(v, rel=1e-5)
    drag = bench.run("axis", [bump("drag", F=20.0)], np.zeros(1000), speeds={"carriage": v}, **free)
    taken = 20.0 * 2e-3 * math.sqrt(2 * math.pi)
    assert drag.v[-1, 0] == pytest.approx(math.sqrt(v**2 - 2 * taken / M), rel=1e-4)


@settings(deadline=None)
@given(st.floats(-0.02, 0.06))
def test_hill_force_points_away_from_the_summit(x):
    p = load.build_bump(bump("hill", F=3.0), 1e-3)
    d, height = load.bell(p, x)
    force = p.F * load.HILL * d * height
    assert force * (x - 0.02) >= 0.0
    assert abs(force) <= 3.0 * (1 + 1e-12)


def test_slow_carriage_is_reflected_by_a_hill():
    stopped = bench.run("axis", [bump("hill", F=20.0)], np.zeros(6000), speeds={"carriage": 0.03}, F_c=0.0, F_v=0.0)
    assert stopped.v[-1, 0] == pytest.approx(-0.03, rel=1e-3)
    assert stopped.q.max() < 0.02


@pytest.mark.parametrize("form", ["drag", "hill", "push"])
def test_bump_is_single_or_repeats_every_turn(form):
    once = load.build_bump(bump(form), 1e-3)
    always = load.build_bump(bump(form, every_turn=True), 1e-3)
    x = 0.0205
    for turns in (-2, 0, 3):
        assert load.bell(always, x + turns * 2 * math.pi) == pytest.approx(load.bell(once, x))
    assert load.bell(once, x + 2 * math.pi)[1] == 0.0


def test_push_accelerates_the_carriage_by_its_work():
    r = bench.run("axis", [bump("push", F=30.0)], np.zeros(1000), speeds={"carriage": 0.05}, F_c=0.0, F_v=0.0)
    gained = 30.0 * 2e-3 * math.sqrt(2 * math.pi)
    assert r.v[-1, 0] == pytest.approx(math.sqrt(0.05**2 + 2 * gained / M), rel=1e-4)


@pytest.mark.parametrize(("bend", "far"), [(0.0, 2.0), (3.0, 2.0 * 13**0.5), (-3.0, 2.0 / 13**0.5)])
def test_load_spring_stiffens_or_softens_far_from_its_rest_position(bend, far):
    p = load.build_spring(load.SpringSettings(node="carriage", k=1.0, x0=0.5, bend=bend), 1e-3)
    assert load.spring.py_func(p, 2.5) == pytest.approx(-far)
    assert load.spring.py_func(p, -1.5) == pytest.approx(far)
    assert load.spring.py_func(p, 0.5 + 1e-4) == pytest.approx(-1e-4, rel=1e-6)
