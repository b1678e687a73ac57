"""Portraits: every term has a curve, and the curve matches its equation."""

from functools import cache

import numpy as np
import pytest

from rtctl.plants.physics import TERMS, anywhere
from rtctl.plants.physics.portrait import curve, portrait, typical


@cache
def drawn(name):
    """Portrait of a term, cached."""
    return portrait(TERMS[name])


@pytest.mark.parametrize("name", TERMS)
def test_every_term_has_a_visible_curve(name):
    c = drawn(name)
    assert len(c.x) == len(c.y) == len(c.without) > 100
    assert all(np.isfinite(part).all() for part in (c.x, c.y, c.without))
    added = np.abs(c.y - c.without).max()
    assert added > 0.01 * max(np.ptp(c.y), np.ptp(c.without))  # visible against the curve without the term
    assert np.ptp(c.y) > 1e-3 * np.abs(c.y).max() > 0.0
    assert np.ptp(c.x) > 0.0 and c.x_words and c.y_words
    assert c.settings.term == name and c.settings.node in anywhere(TERMS[name])[c.kind]


@pytest.mark.parametrize("name", TERMS)
def test_portrait_sizes_are_within_the_typical_range(name):
    term = TERMS[name]
    settings = drawn(name).settings
    for parameter, (low, high) in term.typical.items():
        if parameter not in term.scale:
            assert low <= getattr(settings, parameter) <= high


def test_stribeck_portrait_decays_to_the_base_friction():
    c = drawn("friction.stribeck")
    right = c.x > 0
    assert (np.diff(c.y[right]) <= 0).all()
    assert c.y[right][0] == pytest.approx(c.settings.F_s, rel=1e-3)
    assert c.y[right][-1] == pytest.approx(c.without[-1], rel=1e-3)
    assert c.y == pytest.approx(-c.y[::-1])


def test_viscous_portrait_is_proportional_to_speed():
    c = drawn("friction.viscous")
    assert c.y - c.without == pytest.approx(c.settings.B * c.x)


def test_dead_band_portrait_is_zero_within_the_band():
    c = drawn("drive.deadband")
    within = np.abs(c.x) < c.settings.band
    assert (c.y[within] == 0).all() and (c.y[~within] != 0).all()


def test_lag_portrait_reaches_63_percent_after_tau():
    c = drawn("drive.lag")
    at = np.interp(1 - np.exp(-1), c.y, c.x) - c.x[c.without > 0][0]
    assert at == pytest.approx(c.settings.tau, rel=0.02)


def test_delay_portrait_is_shifted_by_the_delay():
    c = drawn("timing.delay")
    first = [c.x[part > 0.5][0] for part in (c.y, c.without)]
    assert first[0] - first[1] == pytest.approx(c.settings.extra, rel=0.01)


def test_slip_portrait_is_bounded_by_F_max():
    c = drawn("transmission.slip")
    assert np.abs(c.y).max() == pytest.approx(c.settings.F_max, rel=1e-3)
    assert np.abs(c.without).max() > 1.5 * c.settings.F_max


def test_backlash_portrait_is_a_loop_of_the_width_of_the_gap():
    c = drawn("transmission.backlash")
    back = slice(*np.flatnonzero(np.diff(c.x) < 0)[[0, -1]])
    there = slice(back.stop + 1, None)
    width = np.interp(0.0, c.y[there], c.x[there]) - np.interp(0.0, c.y[back][::-1], c.x[back][::-1])
    assert width == pytest.approx(c.settings.gap, rel=0.02)


def test_cogging_portrait_has_per_turn_periods():
    c = drawn("ripple.cogging")
    crossings = np.count_nonzero(np.diff(np.sign(c.y)) != 0)
    assert np.ptp(c.x) == pytest.approx(1.0, rel=0.01)
    assert abs(crossings - 2 * c.settings.per_turn) <= 1


def test_viscoelastic_portrait_relaxes_to_the_elastic_force():
    c = drawn("tape.viscoelastic")
    top = int(np.argmax(c.y))
    assert (np.diff(c.y[top:]) < 0).all()
    late = c.x - c.x[top] > 3 * c.settings.tau
    assert c.y[late] == pytest.approx(c.without[late], rel=0.05)
    assert c.y[top] > 1.3 * c.without[-1]


def test_slack_portrait_has_no_pushing_force():
    c = drawn("tape.slack")
    assert c.y.min() >= -1e-9 and c.without.min() < -1.0
    assert c.y[c.x > 0] == pytest.approx(c.without[c.x > 0])


def test_resonance_portrait_rings_at_its_frequency():
    c = drawn("structure.resonance")
    ring = c.x > 0.2 * c.x[-1]
    turns = np.count_nonzero(np.diff(np.sign(c.y[ring])) != 0) / 2
    assert turns / np.ptp(c.x[ring]) == pytest.approx(c.settings.f_Hz, rel=0.1)


def test_radius_change_portrait_grows_with_the_square_of_the_turns():
    c = drawn("geometry.radius_change")
    added = c.y - c.without
    late, half = added[-1], np.interp(0.5 * c.x[-1], c.x, added)
    assert late / half == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("kind, node", [("ldu", "carriage"), ("ivu", "motor1")])
def test_portrait_can_be_drawn_at_any_node(kind, node):
    term = TERMS["friction.viscous"]
    c = curve(term, typical(term, kind, node), kind)
    assert c.y - c.without == pytest.approx(c.settings.B * c.x)
