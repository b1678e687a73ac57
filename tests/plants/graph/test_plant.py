"""Described machines against closed forms: modes, back-EMF, pendulum, rigid joints, energy, reels."""

import math
from typing import Any

import numpy as np
import pytest

from rtctl.idiom import tick
from rtctl.plants import linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.drives import drive_force
from rtctl.plants.graph.layout import NOWHERE, layout
from rtctl.plants.graph.params import build, drive_gain
from rtctl.plants.graph.reel import reel_inertia, wound

SEEN = {"eye": {"body": "a", "column": "eye"}}


@tick
def run(p, s, n):
    for _ in range(n):
        graph.ask(p, s.m)
        graph.take(p, s.m)
        linear.midpoint(s.m)
        graph.weigh(p, s.m)
        linear.advance(s.m)
    graph.read(p, s.m)


def params(h: float, **groups: Any) -> Any:
    machine = Description.model_validate({"sensors": SEEN} | groups)
    return build(layout(machine), dict(machine.paths()), h)


def started(p: Any) -> Any:
    s = np.zeros(1, graph.GRAPH_STATE).view(np.recarray)[0]
    graph.start(p, s)
    return s


def test_belt_mode_has_the_closed_form_frequency_and_damping():
    """w^2 = k (n^2 / J + 1 / m), damping d (n^2 / J + 1 / m) / 2 w, and a rigid-body mode."""
    J, m, n, k, d = 2.1e-5, 1.4, 0.0127, 8e4, 35.0
    p = params(
        1e-4, bodies={"a": {"inertia": J}, "b": {"mass": m}},
        joints={"belt": {"from": "a", "to": "b", "ratio": n, "stiffness": k, "damping": d}},
    )  # fmt: skip
    A, B = graph.state_space(p)
    values = sorted(np.linalg.eigvals(A), key=lambda s: abs(s))
    assert abs(values[0]) < 1e-3 and abs(values[1]) < 1e-3 and B.shape == (4, 0)
    lightness = n * n / J + 1.0 / m
    assert abs(values[3]) == pytest.approx(math.sqrt(k * lightness))
    assert -values[3].real / abs(values[3]) == pytest.approx(0.5 * d * math.sqrt(lightness / k))


@pytest.mark.parametrize("h", [1e-4, 1e-3, 4e-3])
def test_accelerometer_shows_the_instantaneous_acceleration_for_any_substep(h):
    m, k = 2.0, 800.0
    seen = {"eye": {"body": "a", "column": "eye", "measures": "acceleration"}}
    p = params(
        h, sensors=seen, bodies={"a": {"mass": m}, "wall": {"fixed": True}},
        joints={"spring": {"from": "wall", "to": "a", "stiffness": k}},
    )  # fmt: skip
    s = started(p)
    s.m.x[0] = 0.01
    run(p, s, round(0.1 / h))
    w = math.sqrt(k / m)
    assert s.m.y[0] == pytest.approx(-w * w * 0.01 * math.cos(w * 0.1), rel=1e-6)


def test_accelerometer_of_a_sticking_body_shows_zero():
    seen = {"eye": {"body": "a", "column": "eye", "measures": "acceleration"}}
    p = params(
        1e-3, sensors=seen, bodies={"a": {"mass": 2.0, "dry": "1 N"}},
        drives={"motor": {"body": "a", "column": "u", "kind": "force", "gain": 1.0}},
    )  # fmt: skip
    s = started(p)
    s.m.volts[0] = 0.8
    run(p, s, 20)
    assert s.m.y[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("extra", [{}, {"inductance": 1e-3}, {"bandwidth_hz": 300.0}])
def test_voltage_drive_reaches_the_speed_of_its_back_emf(extra):
    """v = (K V / R - T) / (K^2 / R + F_v), independent of inductance and bandwidth."""
    K, R, dry, viscous = 0.05, 2.0, 0.01, 1e-4
    motor = {"body": "a", "kind": "voltage", "gain": 3.0, "torque_constant": K, "resistance": R, "limit": 2.0, **extra}
    sensors = {
        "speed": {"body": "a", "measures": "speed", "column": "v"},
        "i": {"drive": "m", "measures": "current", "column": "i"},
    }
    p = params(
        1e-4, bodies={"a": {"inertia": 1e-5, "dry": dry, "viscous": viscous}}, drives={"m": motor}, sensors=sensors
    )
    s = started(p)
    s.m.volts[0] = 5.0  # beyond the limit
    run(p, s, 30_000)
    speed = (K * 6.0 / R - dry) / (K * K / R + viscous)
    assert s.m.y[0] == pytest.approx(speed, rel=1e-6)
    assert s.m.y[1] == pytest.approx((6.0 - K * speed) / R, rel=1e-6)
    assert drive_force(p, s.m, 0) == pytest.approx(dry + viscous * speed, rel=1e-6)


def test_limit_bounds_the_command_and_output_limit_bounds_the_drive_output():
    p = params(
        1e-4,
        bodies={"a": {"inertia": 1e-5}},
        drives={"m": {"body": "a", "gain": 3.0, "limit": 2.0, "output_limit": 2.5}},
    )
    s = started(p)
    s.m.volts[0] = 5.0
    graph.ask(p, s.m)
    assert s.m.volts[0] == 2.0
    s.m.volts[0] += 0.3  # an offset of the drive
    graph.take(p, s.m)
    assert s.m.u[0] == 2.3
    s.m.volts[0] += 1.0
    graph.take(p, s.m)
    assert s.m.u[0] == 2.5


@pytest.mark.parametrize(
    "drive",
    [
        {"gain": 3.0},
        {"gain": 3.0, "kind": "current", "torque_constant": 0.05},
        {"gain": 3.0, "kind": "voltage", "torque_constant": 0.05, "resistance": 2.0},
    ],
)
def test_drive_gain_is_the_force_per_volt_at_rest(drive):
    machine = Description.model_validate(
        {"bodies": {"a": {"inertia": 1e-5}}, "drives": {"m": {"body": "a", **drive}}, "sensors": SEEN}
    )
    values = dict(machine.paths())
    s = started(p := build(layout(machine), values, 1e-4))
    s.m.u[0] = 2.0
    assert drive_gain(values, "m") * 2.0 == pytest.approx(drive_force(p, s.m, 0))


def test_pendulum_has_its_small_angle_period():
    m, r, J = 0.2, 0.3, 0.02
    p = params(1e-3, bodies={"a": {"inertia": J, "gravity": {"mass": m, "arm": r, "angle": 0.5}}})
    s = started(p)
    s.m.x[0] = -0.5 + 0.01
    run(p, s, round(2 * math.pi * math.sqrt(J / (m * 9.80665 * r)) / 1e-3))
    assert s.m.y[0] == pytest.approx(-0.5 + 0.01, abs=1e-5)
    run(p, s, round(math.pi * math.sqrt(J / (m * 9.80665 * r)) / 1e-3))
    assert s.m.y[0] == pytest.approx(-0.5 - 0.01, abs=1e-5)


def test_rigid_joint_reduces_two_bodies_to_one_coordinate():
    """J = J_a + n^2 m, with gravity and friction scaled by n, for both orientations of the joint."""
    n, J, m = 0.02, 1e-4, 2.0
    bodies = {
        "a": {"inertia": J, "dry": 1e-3},
        "b": {"mass": m, "dry": 0.5, "viscous": 3.0, "gravity": {"incline": 0.3}},
    }
    sensors = {**SEEN, "way": {"body": "b", "column": "way"}}
    for ends, ratio in ((("a", "b"), n), (("b", "a"), 1.0 / n)):
        joint = {"from": ends[0], "to": ends[1], "ratio": ratio}
        p = params(1e-3, bodies=bodies, joints={"screw": joint}, sensors=sensors)
        assert (p.nq, p.nl) == (1, 0)
        assert p.inertia[0] == pytest.approx(J + n * n * m)
        assert p.dry[0] == pytest.approx(1e-3 + n * 0.5) and p.viscous[0] == pytest.approx(n * n * 3.0)
        s = started(p)
        run(p, s, 500)
        push = n * m * 9.80665 * math.sin(0.3) - (1e-3 + n * 0.5)
        tau = (J + n * n * m) / (n * n * 3.0)
        way = -push / (n * n * 3.0) * (0.5 - tau * (1.0 - math.exp(-0.5 / tau)))
        assert s.m.x[0] == pytest.approx(way, rel=1e-3)
        assert s.m.y[1] == pytest.approx(n * s.m.y[0], rel=1e-12)


def test_fixed_body_is_part_of_the_frame():
    machine = Description.model_validate(
        {"bodies": {"base": {"fixed": True}, "a": {"mass": 1.0}}, "sensors": SEEN,
         "joints": {"spring": {"from": "base", "to": "a", "stiffness": 100.0}}}
    )  # fmt: skip
    at = layout(machine)
    assert at.bodies["base"].coordinate == NOWHERE and at.coordinate("a") == 0 and at.nq == 1
    A, _ = graph.state_space(build(at, dict(machine.paths()), 1e-3))
    np.testing.assert_allclose(A, [[0.0, 1.0], [-100.0, 0.0]])


def test_loop_of_springs_conserves_energy():
    springs = {"k1": ("a", "b"), "k2": ("b", "c"), "k3": ("a", "c")}
    joints = {name: {"from": a, "to": b, "stiffness": 300.0} for name, (a, b) in springs.items()}
    p = params(1e-3, bodies={"a": {"mass": 1.0}, "b": {"mass": 2.0}, "c": {"mass": 0.5}}, joints=joints)
    s = started(p)
    s.m.x[:6] = 0.01, -0.02, 0.005, 0.3, -0.1, 0.2

    def energy() -> float:
        q, v = s.m.x[:3], s.m.x[3:6]
        stretch = (q[1] - q[0]) ** 2 + (q[2] - q[1]) ** 2 + (q[2] - q[0]) ** 2
        return 0.5 * float(300.0 * stretch + v[0] ** 2 + 2.0 * v[1] ** 2 + 0.5 * v[2] ** 2)

    first = energy()
    run(p, s, 20_000)
    assert energy() == pytest.approx(first, rel=1e-9)


def test_zero_of_the_drive_low_pass_appears_in_the_transfer_function():
    lag = {"body": "a", "gain": 1.0, "bandwidth_hz": 100.0, "zero": 1e-3}
    A, B = graph.state_space(params(1e-4, bodies={"a": {"mass": 2.0}}, drives={"m": lag}))
    for f in (10.0, 100.0, 400.0):
        s, w = 2j * math.pi * f, 2 * math.pi * 100.0
        wanted = (1 + 1e-3 * s) * w * w / (s * s + 2 * 0.7071 * w * s + w * w) / (2.0 * s * s)
        assert np.linalg.solve(s * np.eye(4) - A, B[:, 0])[0] == pytest.approx(wanted, rel=1e-9)


def reels(**change: Any) -> Any:
    """Two reels on one tape; the first reel has the drive and viscous friction."""
    winds = {"core": 0.01, "thickness": 1e-3, "density": 1000.0, "width": 0.005}
    bodies = {
        "a": {"inertia": 4e-4, "radius": 0.03, "viscous": 1e-3, "reel": winds},
        "b": {"inertia": 2e-4, "radius": 0.04, "reel": winds, **change},
    }
    joints = {"tape": {"from": "b", "to": "a", "span": "crossed", "stiffness": 2e4, "damping": 20.0}}
    drives = {"m": {"body": "a", "gain": 1.0}}
    return params(1e-4, bodies=bodies, joints=joints, drives=drives)


def test_tape_length_between_two_reels_is_conserved():
    p = reels()
    s = started(p)
    s.m.volts[0] = 0.05
    run(p, s, 15_000)
    grow = 1e-3 / (2 * math.pi)
    a, b = wound(s.m.x[0], 0.03, grow, 0.01), wound(s.m.x[1], 0.04, grow, 0.01)
    assert a > 1.0 and a + b == pytest.approx(0.0, abs=1e-3)
    assert s.m.reel_R[0] > 0.034 and s.m.reel_R[1] < 0.037
    for k, (J, R) in enumerate(((4e-4, 0.03), (2e-4, 0.04))):
        assert s.m.reel_J[k] == pytest.approx(reel_inertia(J, 5.0, s.m.reel_R[k], R), rel=1e-9)


def test_halving_the_step_keeps_the_winding_motion():
    """Relative difference below 1e-5, with drive and friction at the reel."""
    one, two = reels(), reels()._replace(h=5e-5)
    whole, half = started(one), started(two)
    for p, s, n in ((one, whole, 10_000), (two, half, 20_000)):
        s.m.volts[0] = 0.05
        run(p, s, n)
    np.testing.assert_allclose(whole.m.x[:2], half.m.x[:2], rtol=1e-5)


def test_substep_allocates_no_memory(allocations):
    p = reels()
    s = started(p)
    assert allocations(run, p, s, 1000) == allocations(run, p, s, 1)


def test_constant_pull_accelerates_the_mass_through_the_ratio():
    """v = F t / m with the mass reflected through the ratio."""
    for ratio in (1.0, 2.0):
        p = params(
            1e-3, bodies={"a": {"mass": 2.0}, "b": {"mass": 3.0, "pull": 0.7}},
            joints={"rod": {"from": "a", "to": "b", "ratio": ratio}},
        )  # fmt: skip
        s = started(p)
        run(p, s, 500)
        assert s.m.x[1] == pytest.approx(0.7 * ratio * 0.5 / (2.0 + 3.0 * ratio**2), rel=1e-9)
