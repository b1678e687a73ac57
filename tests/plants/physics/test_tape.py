"""Viscoelastic tape and slack tape."""

import bench
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants.physics import tape


def branches(h: float, **values: float):
    return tape.build_viscoelastic(tape.ViscoelasticSettings(node="tape1", **values), h)


def state() -> np.recarray:
    return np.zeros(1, tape.VISCOELASTIC_STATE).view(np.recarray)[0]


@settings(deadline=None)
@given(st.floats(1e-5, 100), st.floats(1e-5, 1e-2))
def test_elongation_step_relaxes_with_its_time_constant(tau, h):
    p, s = branches(h, c_branch=200.0, tau=tau), state()
    pulls = [tape.viscoelastic(p, s, 1e-3, 0.0) for _ in range(20)]
    mean = tau / h * (1 - np.exp(-h / tau))  # over a substep
    assert pulls == pytest.approx([0.2 * mean * np.exp(-k * h / tau) for k in range(20)], rel=1e-6, abs=1e-12)


def test_viscoelastic_tape_is_soft_at_low_and_stiff_at_high_rates():
    pulls = {}
    for name, rate in (("fast", 1e-1), ("slow", 1e-5)):
        h = 1e-3 / rate / 1000
        p, s = branches(h, c_branch=200.0, tau=0.1, c_branch2=50.0, tau2=0.1), state()
        pulls[name] = [tape.viscoelastic(p, s, (k + 0.5) * h * rate, rate) for k in range(1000)][-1]
    assert pulls["fast"] == pytest.approx(250 * 0.1 * 1e-1 * (1 - np.exp(-0.1)), rel=1e-3)
    assert pulls["slow"] == pytest.approx(250 * 0.1 * 1e-5, rel=1e-6)  # a damper


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=40), st.floats(1e-4, 10))
def test_viscoelastic_tape_is_passive(rates, tau):
    h = 1e-3
    p, s, e, work = branches(h, c_branch=100.0, tau=tau), state(), 0.0, 0.0
    for rate in rates:
        work += tape.viscoelastic(p, s, e + 0.5 * h * rate, rate) * rate * h
        e += h * rate
        assert work >= -1e-12


def test_slack_tape_transmits_no_pushing_force():
    """Motor 1 pays out and motor 2 rests: a linear tape pushes reel 2, a slack tape does not."""
    inputs = np.concatenate([np.full((300, 2), 0.5), np.tile([-0.5, 0.0], (200, 1))])
    for share, pushes in ((0.0, True), (1.0, False)):
        terms = [bench.usual("tape.slack", "ivu", "tape1", share=share)]
        r = bench.run("ivu", terms, inputs)
        e = 0.038 * r.q[:, 1] - 0.0125 * r.q[:, 2]
        assert e[300:].min() < 0.0
        reel2 = 0.022 * (r.q[-1, 3] - r.q[299, 3])
        assert (reel2 > 3e-5) == pushes


def test_option_other_applies_slack_to_both_tapes():
    """Motor 1 pays out: tape 1 pushes the capstan back unless both tapes can be slack."""
    inputs = np.concatenate([np.full((300, 2), 0.5), np.tile([-0.5, 0.0], (200, 1))])
    way = {}
    for other in (0.0, 1.0):
        q = bench.run("ivu", [bench.usual("tape.slack", "ivu", "tape2", other=other)], inputs).q
        way[other] = 0.0125 * (q[-1, 2] - q[299, 2])
    assert way[0.0] < 3 * way[1.0] < 0.0


@given(st.floats(-10, 10), st.floats(0, 1))
def test_slack_removes_only_compression(T, share):
    total = T + tape.slack(share, T)
    assert total == pytest.approx(T if T > 0 else (1 - share) * T)
