"""A long rest at the end is left out, and only that; a stop counts as little as it tells."""

import numpy as np
import pytest

from rtctl.diagnose import rest
from rtctl.diagnose.rest import REST, awake, bounded, shares, telling

MOVE, RATE = 5.0, 1000


@pytest.fixture
def resting(blank):
    def make(rest, works=False):
        t = np.arange(round((MOVE + rest) * RATE)) / RATE
        x = np.where(t < MOVE, 0.05 * (1 - np.cos(2 * np.pi * t / MOVE * 1.5)), 0.1)
        u = np.where(t < MOVE, np.sin(t), 0.5 * np.sin(40 * t) if works else 0.2)
        return blank("axis", u, x)

    return make


def test_what_follows_the_last_motion_is_left_out(resting):
    record = resting(60.0)
    short = awake(record)
    assert len(short.t) * short.dt == pytest.approx(MOVE + REST, abs=0.3)
    for name in ("ref", "w", "u"):
        assert len(getattr(short, name)) == len(short.t) == len(short.y["x"])
    assert len(record.t) == 65 * RATE


@pytest.mark.parametrize(("rest", "works"), [(0.0, False), (4.0, False), (60.0, True)])
def test_a_short_rest_and_a_machine_that_is_pushed_at_rest_stay(resting, rest, works):
    record = resting(rest, works)
    assert awake(record) is record


@pytest.fixture
def long(blank, monkeypatch):
    """A minute of motion behind a minute of rest, where half a minute is all that is held."""
    monkeypatch.setitem(rest.LONGEST, "axis", 30 * RATE)
    t = np.arange(120 * RATE) / RATE
    x = np.where(t < 60.0, 0.0, np.sin(t - 60.0))
    return blank("axis", np.where(t < 60.0, 0.0, np.cos(t)), x)


def test_of_a_long_recording_as_much_is_taken_as_can_be_held_from_its_first_motion_on(long):
    record = bounded(long)
    assert len(record.t) == 30 * RATE == len(record.y["x"]) == len(record.u)
    assert record.t[0] == pytest.approx(60.0 - REST, abs=0.1)
    assert bounded(record) is record


def test_what_is_left_out_is_said(long, resting):
    assert telling(long)[1] == [
        "Of 120 s, 57 to 87 s are looked at; rtctl simulate tells how the model predicts all of them."
    ]
    assert telling(resting(20.0))[1] == ["The last 17 s, in which it rests, are left out."]
    assert telling(resting(0.0))[1] == []


def test_all_of_a_stop_counts_for_as_much_as_a_moment_in_motion():
    way = np.concatenate((np.arange(400.0), np.full(1000, 400.0), np.arange(401.0, 800.0)))
    noisy = np.round(way + np.random.default_rng(1).normal(0.0, 0.3, len(way)))
    share = shares(noisy, 1.0, memory=50)
    assert (share[:375] == 1.0).all() and (share[1425:] == 1.0).all()
    assert share[share < 1.0].sum() == pytest.approx(50, rel=1e-6)


def test_slow_motion_is_motion():
    assert (shares(np.floor(0.1 * np.arange(2000.0)), 1.0, memory=50) == 1.0).all()
