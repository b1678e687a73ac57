"""Friction under load: a share of what presses, at its lever."""

import bench
import numpy as np
import pytest


def test_the_axis_loses_a_share_of_its_drive_force():
    term = bench.usual("friction.load", "axis", mu=0.2)
    r = bench.run("axis", [term], np.full(500, 3.0), F_v=0.0, F_c=0.0)
    assert r.v[-1, 0] / 0.5 == pytest.approx(0.8 * 3.0 * 35.15 / 95.1, rel=1e-9)


@pytest.mark.parametrize("hold", [0.4, 0.8])
def test_a_reel_drags_in_proportion_to_the_tension(hold):
    """Held by both motors at one tension the break-away difference of motor 1 grows by mu T R."""
    term = bench.usual("friction.load", "ivu", "reel1", mu=0.1)
    r = bench.run("ivu", [term], np.full((2000, 2), hold))
    tension = 450.0 * (0.038 * r.q[-1, 1] - 0.0125 * r.q[-1, 2])
    assert tension > 0.05
    assert r.s.m.dry[1] == pytest.approx(0.1 * tension * 0.038, rel=0.01)


def test_the_capstan_takes_the_mean_of_both_tapes():
    term = bench.usual("friction.load", "ivu", "capstan", mu=0.1)
    r = bench.run("ivu", [term], np.full((2000, 2), 0.6))
    T1 = 450.0 * (0.038 * r.q[-1, 1] - 0.0125 * r.q[-1, 2])
    T2 = 450.0 * (0.022 * r.q[-1, 3] + 0.0125 * r.q[-1, 2])
    assert r.s.m.dry[2] == pytest.approx(1e-4 + 0.1 * 0.5 * (T1 + T2) * 0.0125, rel=0.01)


def test_the_wheel_takes_what_the_shaft_transmits():
    term = bench.usual("friction.load", "ldu", "wheel", mu=0.1)
    r = bench.run("ldu", [term], np.full(100, 0.03))  # too little to move the carriage
    torque = 4.2 * (r.q[-1, 0] - 20 * r.q[-1, 1])
    assert torque == pytest.approx(0.03 * 21e-3, rel=0.05)
    assert r.s.m.dry[1] == pytest.approx(0.1 * 20 * torque, rel=0.1)
