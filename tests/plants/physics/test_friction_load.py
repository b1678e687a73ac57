"""Load-dependent friction: a share of the normal force, at its lever."""

import bench
import machine
import numpy as np
import pytest


def test_load_friction_of_the_axis_is_a_share_of_the_drive_force():
    term = bench.usual("friction.load", "axis", mu=0.2)
    r = bench.run("axis", [term], np.full(500, 3.0), F_v=0.0, F_c=0.0)
    assert r.v[-1, 0] / 0.5 == pytest.approx(0.8 * 3.0 * 35.15 / 95.1, rel=1e-9)


@pytest.mark.parametrize("hold", [0.4, 0.8])
def test_load_friction_of_a_reel_is_proportional_to_the_tension(hold):
    """Under a constant tension T, the dry friction of the reel is mu T R."""
    term = bench.usual("friction.load", "ivu", "reel1", mu=0.1)
    r = bench.run("ivu", [term], np.full((2000, 2), hold))
    tension = 450.0 * (0.038 * r.q[-1, 1] - 0.0125 * r.q[-1, 2])
    assert tension > 0.05
    assert r.s.m.dry[1] == pytest.approx(0.1 * tension * 0.038, rel=0.01)


def test_load_friction_of_the_capstan_uses_the_mean_tension():
    term = bench.usual("friction.load", "ivu", "capstan", mu=0.1)
    r = bench.run("ivu", [term], np.full((2000, 2), 0.6))
    T1 = 450.0 * (0.038 * r.q[-1, 1] - 0.0125 * r.q[-1, 2])
    T2 = 450.0 * (0.022 * r.q[-1, 3] + 0.0125 * r.q[-1, 2])
    assert r.s.m.dry[2] == pytest.approx(1e-4 + 0.1 * 0.5 * (T1 + T2) * 0.0125, rel=0.01)


def test_load_friction_of_the_wheel_uses_the_shaft_torque():
    term = bench.usual("friction.load", "ldu", "wheel", mu=0.1)
    r = bench.run("ldu", [term], np.full(100, 0.03))  # too little to move the carriage
    torque = 4.2 * (r.q[-1, 0] - 20 * r.q[-1, 1])
    assert torque == pytest.approx(0.03 * 21e-3, rel=0.05)
    assert r.s.m.dry[1] == pytest.approx(0.1 * 20 * torque, rel=0.1)


def test_load_friction_of_a_body_sums_all_its_joints():
    three = {
        "bodies": {"a": {"inertia": 1e-3}, "b": {"inertia": 1.0}, "c": {"inertia": 1e3}},
        "joints": {"one": {"from": "a", "to": "b", "ratio": 0.5, "stiffness": 200.0, "damping": 2.0},
                   "two": {"from": "b", "to": "c", "ratio": 2.0, "stiffness": 100.0, "damping": 5.0}},
        "drives": {"amplifier": {"body": "a", "column": "u", "kind": "force", "gain": 1.0}},
        "sensors": {name: {"joint": name, "measures": "force", "column": name, "resolution": 1e-6}
                    for name in ("one", "two")},
    }  # fmt: skip
    r = machine.run(three, [machine.settings("friction.load", "b", mu=0.1)], np.full(200, 2.0))
    one, two = np.abs(r.y[-1])
    assert one > 3.5 and two > 0.1
    assert r.dry[-1, 1] == pytest.approx(0.1 * (one + 2.0 * two), rel=2e-2)


def test_load_friction_by_weight_follows_the_gravity_torque():
    arm = {
        "bodies": {"arm": {"inertia": 0.1, "gravity": {"mass": 1.0, "arm": 0.2, "angle": 0.3}}},
        "drives": {"amplifier": {"body": "arm", "column": "u", "kind": "force", "gain": 1.0}},
        "sensors": {"encoder": {"body": "arm", "measures": "position", "column": "counts", "counts_per_unit": 1e6}},
    }  # fmt: skip
    r = machine.run(arm, [machine.settings("friction.load", "arm", mu=0.2, by="weight")], np.full(200, 3.0))
    assert np.ptp(r.x[:, 0]) > 0.3
    assert r.dry[1:, 0] == pytest.approx(0.2 * 9.80665 * 0.2 * np.abs(np.sin(r.x[:-1, 0] + 0.3)), abs=5e-3)
