"""Presliding bristles: elastic at first, dry friction after z_s, hysteresis, stable for any stiffness."""

import bench
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rtctl.plants.physics import presliding

F_C, M = 20.4, 95.1  # of the axis


def push(force: np.ndarray, z_s: float, form: str = "dahl", substeps: int = 4, **parameters: float) -> bench.Run:
    """Run of the axis under a force (n,) in N, one value per tick."""
    term = bench.usual("friction.presliding", "axis", z_s=z_s, form=form)
    return bench.run("axis", [term], force / 35.15, substeps=substeps, **parameters)


@settings(deadline=None)
@given(st.floats(-1, 1), st.floats(-10, 10), st.floats(-10, 10), st.floats(1e-3, 1))
def test_bristle_step_is_exact_and_bounded_by_one(w, one, two, z):
    at_once = presliding.bend(w, abs(one) + abs(two), z)
    assert presliding.bend(presliding.bend(w, abs(one), z), abs(two), z) == pytest.approx(at_once, abs=1e-12)
    assert abs(presliding.bend(w, one, z)) <= 1.0
    assert (presliding.bend(w, one, z) - w) * np.sign(one) >= -1e-15


@settings(deadline=None, max_examples=300)
@given(
    st.floats(-1, 1),
    st.floats(-1, 1),
    st.floats(0, 100),
    st.floats(-9, 0).map(lambda x: 10**x),
    st.sampled_from([0.0, 3e-3]),
    st.floats(-10, 10),
    st.floats(-10, 10),
    st.floats(-6, 3).map(lambda x: 10**x),
)
@example(0.0, 0.0, 1.0, 1e-9, 0.0, 1.0, 0.0, 1.0)  # extreme stiffness
def test_bristle_force_solves_the_implicit_equation(w, last, F_C, z, tau, v, vm, gain):
    h = 5e-4
    F = presliding.bristles(w, last * F_C, F_C, z, tau, v, vm, gain, h)
    k = F_C * gain * h / z
    theta = 0.5 + 0.5 * k / (4.0 + k)
    u = v + 2.0 * theta * (vm - v) + theta * gain * (F - last * F_C)
    w_end = presliding.bend(w, theta * h * u, z)
    damp = tau / (theta * h)
    scale = F_C * (1.0 + damp) + 1e-300
    slope = F_C * (1.0 + damp) * theta * h / z  # how far rounding of the speed carries into the force
    rounding = 1e-9 * scale + 1e-13 * slope * (abs(v) + abs(vm) + theta * gain * scale)
    assert pytest.approx(-F_C * (w_end + damp * (w_end - w)), abs=rounding) == F


@pytest.mark.parametrize("form", ["dahl", "lugre"])
def test_small_force_gives_an_elastic_displacement_with_hysteresis(form):
    z_s = 1e-4
    force = np.concatenate([np.linspace(0, 2.0, 4000), np.linspace(2.0, 0, 4000)])
    r = push(force, z_s, form)
    assert r.q[3999, 0] == pytest.approx(z_s * -np.log(1 - 2.0 / F_C), rel=0.02)
    assert abs(r.q[-1, 0]) < 0.1 * r.q[3999, 0]
    assert r.q[-1, 0] > 0.0  # residual displacement: hysteresis


@pytest.mark.parametrize("form", ["dahl", "lugre"])
def test_presliding_axis_slides_at_the_dry_friction_level(form):
    r = push(np.full(4000, 60.0), 1e-5, form, F_v=0.0)
    rate = (r.v[-1, 0] - r.v[2000, 0]) / (1999 * 1e-3)
    assert rate == pytest.approx((60.0 - F_C) / M, rel=1e-6)


@pytest.mark.parametrize("z_s", [1e-9, 1e-7, 1e-5])
@pytest.mark.parametrize("form", ["dahl", "lugre"])
def test_stiff_bristles_hold_below_break_away_and_do_not_ring(z_s, form):
    force = 6.0 * np.repeat(np.random.default_rng(1).uniform(-1, 1, 100), 20)
    r = push(force, z_s, form, substeps=2)
    assert np.abs(r.q).max() < 3 * z_s + 2e-7  # displacement before the bristle force builds up
    rest = push(np.concatenate([force, np.full(500, force[-1])]), z_s, form, substeps=2)
    fade = 0.05 if form == "lugre" else 0.2  # bare bristles have the axis's own damping only
    assert np.abs(rest.v[-100:]).max() < fade * np.abs(rest.v).max()


def test_presliding_converges_to_dry_friction_for_small_z_s():
    inputs = bench.moves("axis")
    plain = bench.run("axis", [], inputs)
    far = [
        np.abs(bench.run("axis", [bench.usual("friction.presliding", "axis", z_s=z)], inputs).y - plain.y).max()
        for z in (1e-3, 1e-4, 1e-5, 1e-6)
    ]
    assert far == sorted(far, reverse=True)
    assert far[-1] < 0.01 * np.abs(plain.y).max()


def test_bristle_level_includes_preceding_coulomb_terms():
    force = np.linspace(0.0, 26.0, 2000)  # above 20.4, below 30.4
    more = bench.usual("friction.coulomb", "axis", F_C=10.0)
    bristles = bench.usual("friction.presliding", "axis", z_s=1e-5)
    assert bench.run("axis", [bristles], force / 35.15).q[-1, 0] > 1e-3
    assert abs(bench.run("axis", [more, bristles], force / 35.15).q[-1, 0]) < 1e-4


def test_presliding_dissipates_energy_over_closed_paths():
    t = np.arange(4000) * 1e-3
    r = push(25.0 * np.sin(2 * np.pi * 2 * t), 1e-4, substeps=8)
    lost = -np.diff(r.work[::500])
    assert (lost[1:] > 0.0).all()
