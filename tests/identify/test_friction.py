"""Friction: parameters of the emulator are recovered; (8.3) is fitted if the points support it, else refused."""

import bench_runs as runs
import numpy as np
import pytest

from rtctl.config.errors import NoAnswer, UserError
from rtctl.identify import bench
from rtctl.identify import friction as fr

REELS = ((0.038, 0.022), (0.022, 0.038), (0.031, 0.031))
SPEEDS = (0.3, 1.2, 4.0)


def velocity(config, *speeds):
    return fr.velocity_config(config, speeds, 3)


def rubs(config):
    """Stribeck friction at motor 1: 4 mNm at rest, v_s of 0.3 rad/s at the motor."""
    term = {"term": "friction.stribeck", "node": "motor1", "F_s": 4e-3, "v_s": 0.3}
    return bench.changed(config, {"plant.physics": [term]})


def stribeck_velocity(config):
    return fr.velocity_config(rubs(config), (0.1, 0.3, 0.6, 1.0, 2.0, 4.0), 2)


def stribeck_break_away(config):
    return fr.break_away_config(rubs(config), 1)


def test_common_friction_of_both_motors_of_the_reel_unit():
    """Common value: between 2.4 and 2.6 mNm of the motors, plus the share of the capstan."""
    points, refused = fr.constant_velocity(runs.played(velocity, "ivu", *SPEEDS), 3)
    assert not refused and len(points) == 6
    for p in points:
        assert abs(p.force) == pytest.approx(2.64e-3, rel=0.01)
        assert np.sign(p.v) == np.sign(p.force)
        assert p.error < 0.01 * abs(p.force)


def test_friction_of_each_motor_is_identified_from_three_pairs_of_reels():
    records = []
    for R1, R2 in REELS:
        config = runs.config("ivu", radius__R1=R1, radius__R2=R2, plant__parameters__R1=R1, plant__parameters__R2=R2)
        records.append(bench.play(fr.velocity_config(config, [1.0], 4)))
    tau = fr.split(records, 4)
    assert tau.tau_1 == pytest.approx(2.4e-3, rel=0.02)
    assert tau.tau_2 == pytest.approx(2.6e-3, rel=0.02)
    assert tau.tau_c == pytest.approx(1e-4, rel=0.2)
    assert abs(tau.tau_1 - 2.4e-3) < 2 * tau.half[0]
    with pytest.raises(NoAnswer, match="too alike"):
        fr.split(records[:1], 4)


def test_break_away_force_of_the_reel_unit():
    for p in fr.break_away(runs.played(fr.break_away_config, "ivu", 1)):
        assert abs(p.force) == pytest.approx(2.64e-3, rel=0.03)


def test_break_away_voltage_of_the_printer_is_that_of_the_thesis():
    """12.6: 0.93 V forwards, 0.88 V backwards, by a weak spring."""
    forward, backward = fr.break_away(runs.played(fr.break_away_config, "ldu_printer", 1))
    assert forward.force == pytest.approx(0.93, abs=0.006)
    assert backward.force == pytest.approx(-0.88, abs=0.006)
    assert forward.newtons == pytest.approx(7.70, rel=0.01)
    assert backward.newtons == pytest.approx(-7.0, rel=0.01)


def test_friction_of_the_printer_has_no_stribeck_effect():
    """12.6: no decrease at small velocities, nor a significant viscous friction."""
    record = runs.played(printer_velocity, "ldu_printer")
    points, _ = fr.constant_velocity(record, 2)
    result = fr.friction([*points, *fr.break_away(runs.played(fr.break_away_config, "ldu_printer", 1))], [], "ldu")
    for fit in (result.both, result.forward, result.backward):
        assert fit is not None and fit.F_S is None
        assert fit.F_v * 10 < 0.02 * fit.F_C


def printer_velocity(config):
    return fr.velocity_config(config, (2.0, 6.0, 12.0, 18.0), 2)


def test_stribeck_friction_of_the_reel_unit():
    points, _ = fr.points_of([runs.played(stribeck_break_away, "ivu"), runs.played(stribeck_velocity, "ivu")], 2)
    result = fr.friction(points, [], "ivu")
    # motor 1 carries 22/(22 + 38) of the whole along the tape
    for fit in (result.forward, result.backward):
        assert fit is not None and fit.F_S is not None and fit.v_s is not None
        assert fit.F_S - fit.F_C == pytest.approx(1.6e-3 * 22 / 60, rel=0.06)
        assert fit.v_s == pytest.approx(0.3 * 38 / 12.5, rel=0.05)


def test_short_or_motionless_record_is_refused():
    record = runs.played(velocity, "ivu", *SPEEDS)
    with pytest.raises(NoAnswer, match=r"3\.\d turns at constant speed; it takes 12"):
        fr.constant_velocity(record, 12)
    still = {name: np.zeros(1000) for name in ("target", "capstan", "u1", "u2")} | {"R1": np.full(1000, 0.03)}
    with pytest.raises(NoAnswer, match="no stretch"):
        fr.constant_velocity(runs.made("ivu", still | {"R2": still["R1"]}), 2)
    held = still | {"R2": still["R1"], "target": np.linspace(0, 1, 1000), "u1": np.linspace(0, 2, 1000)}
    with pytest.raises(NoAnswer, match=r"never broke away from 0\.00 to 2\.00 s"):
        fr.break_away(runs.made("ivu", held))


def test_saturated_drive_is_no_break_away():
    n = 2000
    u = np.minimum(np.linspace(0, 20, n), 10.0)
    moved = np.where(np.arange(n) > 1500, np.arange(n) - 1500.0, 0.0) * 1e-2
    columns = {"target": np.linspace(0, 1, n), "capstan": moved, "u1": u, "u2": 0 * u}
    with pytest.raises(NoAnswer, match="at its limit of 10 V"):
        fr.break_away(runs.made("ivu", columns | {"R1": np.full(n, 0.03), "R2": np.full(n, 0.03)}))


def test_fast_rise_is_no_break_away():
    """Start of a normal move: the force includes the acceleration."""
    with pytest.raises(NoAnswer, match="no slow ramp"):
        fr.break_away(runs.played(velocity, "ivu", *SPEEDS))


def test_spring_force_is_not_a_stribeck_effect():
    """12.6: more force at constant speed forwards, less backwards, and the same mean as at the home position."""
    speeds = (1.5, 3.0, 6.0, 12.0)
    points = [fr.Point(0.0, sign * 0.9 + 0.025, 0.0, 0.0) for sign in (1, -1)]
    points += [fr.Point(sign * v, sign * 0.9 + 0.06, 0.0, 0.0) for v in speeds for sign in (1, -1)]
    result = fr.friction(points, [], "ldu")
    assert result.both.F_C == pytest.approx(0.9)
    assert result.both.F_S is result.forward.F_S is result.backward.F_S is None
    assert (result.forward.F_C, result.backward.F_C) == pytest.approx((0.96, 0.84))


def test_axis_has_no_capstan_friction():
    with pytest.raises(UserError, match="for ivu and ldu, not for axis"):
        fr.velocity_config(runs.config("axis"), [1.0])
