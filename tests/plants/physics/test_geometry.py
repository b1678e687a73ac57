"""Radius change of a reel: equal to the plant with a tape thickness."""

import numpy as np
import pytest
import stand

from rtctl.idiom import tick
from rtctl.plants import ivu, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph import reel
from rtctl.plants.physics import TERMS, geometry, ripple_tape

ROUND = ripple_tape.build_reel(ripple_tape.ReelSettings(node="reel2", e=0.0), 5e-4)


@tick
def wind(p, s, volts, substeps, x, ripple):
    """Run of the plant with its variable radii and an eccentric second reel."""
    m = s.m
    for k in range(volts.shape[0]):
        for _ in range(substeps):
            m.u[0], m.u[1] = volts[k, 0], volts[k, 1]
            linear.midpoint(m)
            graph.weigh(p.graph, m)
            ripple_tape.reel(ripple, m, ivu.REEL2, 1)
            ripple_tape.reel_arm(ripple, m, ivu.REEL2, 1)
            linear.advance(m)
        for i in range(m.nx):
            x[k, i] = m.x[i]


def volts(n: int = 1500) -> np.ndarray:
    """Volts (n, 2) for a reciprocating motion over several turns of the reels."""
    wave = np.sin(2 * np.pi * np.arange(n) / n)
    return np.stack([2.0 + 6.0 * wave, 2.0 - 6.0 * wave], axis=1)


@pytest.mark.parametrize(("radii", "within"), [({"R1": 0.035, "R2": 0.028}, 0.06), ({}, 0.2)])
@pytest.mark.parametrize("d", [2e-4, 1e-3])
def test_radius_change_of_both_reels_equals_the_plant_with_a_tape_thickness(d, radii, within):
    """Four to nine turns at the longest substep in use; the second set has a nearly empty reel."""
    u = volts()
    terms = [stand.make("geometry.radius_change", "ivu", node, d=d) for node in ("reel1", "reel2")]
    got = stand.run("ivu", terms, u, d_tape=0.0, **radii).x
    base = stand.run("ivu", [], u, d_tape=0.0, **radii).x
    p, s = stand.plant("ivu", 5e-4, d_tape=d, **radii)
    expected = np.zeros_like(got)
    wind(p, s, u, 4, expected, ROUND)
    assert np.abs(expected[:, :5]).max(axis=0).min() > 3 * 2 * np.pi
    change = np.abs(expected - base)[:, :5].max(axis=0)
    assert (change > 0.1).all()
    assert (np.abs(got - expected)[:, :5].max(axis=0) < within * change).all()


@pytest.mark.parametrize("node", ["reel1", "reel2"])
def test_option_other_changes_the_radius_of_both_reels(node):
    both = [stand.make("geometry.radius_change", "ivu", reel, d=5e-4) for reel in ("reel1", "reel2")]
    one = stand.make("geometry.radius_change", "ivu", node, d=5e-4, other=1.0)
    many, few = (stand.run("ivu", terms, volts(), d_tape=0.0).x for terms in (both, [one]))
    alone = stand.run("ivu", [stand.make("geometry.radius_change", "ivu", node, d=5e-4)], volts(), d_tape=0.0).x
    assert np.abs(few - many).max() < 0.02 * np.abs(few - alone).max()


def test_plant_computes_the_tension_at_the_true_radius():
    p, s = stand.plant("ivu", 2.5e-4, d_tape=1e-3)
    wind(p, s, volts(600), 8, np.zeros((600, 14)), ROUND)
    linear.midpoint(s.m)
    graph.weigh(p.graph, s.m)
    (T1, T2), (R1, R2) = (linear.tension(s.m, tape) for tape in (0, 1)), s.m.reel_R[:2]
    grow, x = p.d_tape / (2 * np.pi), s.m.x
    for T, at, R, way, c, k in ((T1, ivu.REEL1, R1, -1, p.c1, p.k1), (T2, ivu.REEL2, R2, 1, p.c2, p.k2)):
        stretch = way * p.R_c * x[ivu.CAPSTAN] + reel.wound(x[at], p.R1 if way < 0 else p.R2, grow, p.R_min)
        rate = way * p.R_c * x[ivu.NQ + ivu.CAPSTAN] + R * x[ivu.NQ + at]
        assert pytest.approx(c * stretch + k * rate, abs=0.02) == T


@pytest.mark.parametrize("node", ["reel1", "reel2"])
def test_radius_change_is_proportional_to_the_thickness(node):
    u = volts(600)

    def change(d: float) -> np.ndarray:
        term = stand.make("geometry.radius_change", "ivu", node, d=d)
        return stand.run("ivu", [term], u, d_tape=0.0).x - stand.run("ivu", [], u, d_tape=0.0).x

    one, two = change(1e-5), change(2e-5)
    assert np.abs(one[:, :5]).max() > 1e-4
    assert np.allclose(two[:, :5], 2 * one[:, :5], atol=0.02 * np.abs(one[:, :5]).max())


def test_empty_reel_keeps_the_core_radius():
    _, s = stand.plant("ivu", 2.5e-4, d_tape=0.0)
    p = geometry.build_radius_change(geometry.RadiusChangeSettings(node="reel1", d=1e-3), 2.5e-4)
    s.m.qm[ivu.REEL1], s.m.qm[ivu.CAPSTAN] = -500.0, -500.0 * 0.02 / 0.0125
    geometry.wind(p, s.m, ivu.LINKS["tape1"], ivu.LINKS["tape2"])
    wound = (linear.tension(s.m, 0) / 450.0) + 0.0125 * s.m.qm[ivu.CAPSTAN]
    turns = (0.038 - 0.02) / (1e-3 / (2 * np.pi))
    assert wound == pytest.approx(-(0.029 * turns + 0.02 * (500.0 - turns)))


def test_reel_ripple_uses_the_present_radius_and_inertia():
    """Ripple combined with radius change. With initial radius and inertia the error was three times
    the effect."""
    ripple = stand.make("ripple.reel", "ivu", "reel2", e=4e-4, phi=0.3)
    tape = stand.make("geometry.radius_change", "ivu", "reel2", d=5e-4, other=1.0)
    u, own = volts(), []
    for e in (0.0, 4e-4):
        p, s = stand.plant("ivu", 5e-4, d_tape=5e-4, R1=0.035, R2=0.028)
        own.append(np.zeros((len(u), 14)))
        wind(p, s, u, 4, own[-1], ripple_tape.build_reel(ripple.model_copy(update={"e": e}), 5e-4))

    runs = [stand.run("ivu", terms, u, d_tape=0.0, R1=0.035, R2=0.028).x for terms in ([tape], [tape, ripple])]
    expected, got = ((two - one)[:, :5] for one, two in (own, runs))
    assert np.abs(got - expected).max() < 0.4 * np.abs(expected).max()


def test_winding_terms_run_before_the_terms_that_use_the_tension():
    """In another order, creep and load-dependent friction would use a stale tension."""
    names = list(TERMS)
    winding = ("geometry.radius_change", "ripple.reel", "ripple.capstan")
    contacts = ("transmission.slip", "transmission.creep")
    tape = ("structure.stiffening", "tape.viscoelastic", "tape.slack")
    assert max(map(names.index, winding)) < min(map(names.index, contacts))
    assert max(map(names.index, contacts)) < min(map(names.index, tape))
    assert max(map(names.index, tape)) < names.index("friction.load")
