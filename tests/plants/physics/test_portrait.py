"""Every term has a curve of its own, and it is the curve that its equation says."""

from functools import cache

import numpy as np
import pytest

from rtctl.plants.physics import TERMS, anywhere
from rtctl.plants.physics.portrait import curve, portrait, typical


@cache
def drawn(name):
    """The portrait of a term, made once."""
    return portrait(TERMS[name])


@pytest.mark.parametrize("name", TERMS)
def test_every_term_draws_a_curve(name):
    c = drawn(name)
    assert len(c.x) == len(c.y) == len(c.without) > 100
    assert all(np.isfinite(part).all() for part in (c.x, c.y, c.without))
    added = np.abs(c.y - c.without).max()
    assert added > 0.01 * max(np.ptp(c.y), np.ptp(c.without))  # it is seen beside what was there without it
    assert np.ptp(c.y) > 1e-3 * np.abs(c.y).max() > 0.0
    assert np.ptp(c.x) > 0.0 and c.x_words and c.y_words
    assert c.settings.term == name and c.settings.node in anywhere(TERMS[name])[c.kind]


@pytest.mark.parametrize("name", TERMS)
def test_typical_sizes_are_within_what_is_met(name):
    term = TERMS[name]
    settings = drawn(name).settings
    for parameter, (low, high) in term.typical.items():
        if parameter not in term.scale:
            assert low <= getattr(settings, parameter) <= high


def test_sticking_falls_with_speed_to_the_base_friction():
    c = drawn("friction.stribeck")
    right = c.x > 0
    assert (np.diff(c.y[right]) <= 0).all()
    assert c.y[right][0] == pytest.approx(c.settings.F_s, rel=1e-3)
    assert c.y[right][-1] == pytest.approx(c.without[-1], rel=1e-3)
    assert c.y == pytest.approx(-c.y[::-1])


def test_viscous_friction_grows_in_proportion():
    c = drawn("friction.viscous")
    assert c.y - c.without == pytest.approx(c.settings.B * c.x)


def test_a_dead_zone_does_nothing_within_its_band():
    c = drawn("drive.deadband")
    within = np.abs(c.x) < c.settings.band
    assert (c.y[within] == 0).all() and (c.y[~within] != 0).all()


def test_a_lag_has_risen_by_a_time_constant():
    c = drawn("drive.lag")
    at = np.interp(1 - np.exp(-1), c.y, c.x) - c.x[c.without > 0][0]
    assert at == pytest.approx(c.settings.tau, rel=0.02)


def test_a_delay_is_late_by_itself():
    c = drawn("timing.delay")
    first = [c.x[part > 0.5][0] for part in (c.y, c.without)]
    assert first[0] - first[1] == pytest.approx(c.settings.extra, rel=0.01)


def test_a_contact_carries_no_more_than_it_can():
    c = drawn("transmission.slip")
    assert np.abs(c.y).max() == pytest.approx(c.settings.F_max, rel=1e-3)
    assert np.abs(c.without).max() > 1.5 * c.settings.F_max


def test_play_is_a_loop_as_wide_as_its_gap():
    c = drawn("transmission.backlash")
    back = slice(*np.flatnonzero(np.diff(c.x) < 0)[[0, -1]])
    there = slice(back.stop + 1, None)
    width = np.interp(0.0, c.y[there], c.x[there]) - np.interp(0.0, c.y[back][::-1], c.x[back][::-1])
    assert width == pytest.approx(c.settings.gap, rel=0.02)


def test_cogging_comes_as_often_as_it_says():
    c = drawn("ripple.cogging")
    crossings = np.count_nonzero(np.diff(np.sign(c.y)) != 0)
    assert np.ptp(c.x) == pytest.approx(1.0, rel=0.01)
    assert abs(crossings - 2 * c.settings.per_turn) <= 1


def test_a_tape_relaxes_to_its_own_spring():
    c = drawn("tape.viscoelastic")
    top = int(np.argmax(c.y))
    assert (np.diff(c.y[top:]) < 0).all()
    late = c.x - c.x[top] > 3 * c.settings.tau
    assert c.y[late] == pytest.approx(c.without[late], rel=0.05)
    assert c.y[top] > 1.3 * c.without[-1]


def test_a_slack_tape_does_not_push():
    c = drawn("tape.slack")
    assert c.y.min() >= -1e-9 and c.without.min() < -1.0
    assert c.y[c.x > 0] == pytest.approx(c.without[c.x > 0])


def test_a_resonance_rings_at_its_frequency():
    c = drawn("structure.resonance")
    ring = c.x > 0.2 * c.x[-1]
    turns = np.count_nonzero(np.diff(np.sign(c.y[ring])) != 0) / 2
    assert turns / np.ptp(c.x[ring]) == pytest.approx(c.settings.f_Hz, rel=0.1)


def test_a_growing_reel_goes_with_the_square_of_the_turns():
    c = drawn("geometry.radius_change")
    added = c.y - c.without
    late, half = added[-1], np.interp(0.5 * c.x[-1], c.x, added)
    assert late / half == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("kind, node", [("ldu", "carriage"), ("ivu", "motor1")])
def test_any_node_of_any_plant_can_be_drawn(kind, node):
    term = TERMS["friction.viscous"]
    c = curve(term, typical(term, kind, node), kind)
    assert c.y - c.without == pytest.approx(c.settings.B * c.x)
