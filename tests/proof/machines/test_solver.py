"""Equations of motion of described machines against closed forms, and the integration error."""

import math

import numpy as np
import pytest

from rtctl.proof.machines import simulate as sim
from rtctl.proof.machines.arrays import NB

WEIGHT = 9.81


def crossings(x):
    """Times (ticks) of the upward zero crossings of x, interpolated."""
    k = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    return k - x[k] / (x[k + 1] - x[k])


def test_pendulum_has_its_period_and_conserves_energy(free):
    mass, arm, inertia = 0.7, 0.2, 0.04
    body = {"inertia": inertia, "gravity": {"mass": mass, "arm": arm, "angle": 0.0}}
    states = free({"bodies": {"pendulum": body}}, 0.0, [0.05], 6000)
    q, v = states[:, 0], states[:, NB]
    wanted = 2.0 * math.pi * math.sqrt(inertia / (mass * WEIGHT * arm)) * (1.0 + 0.05**2 / 16.0)
    assert np.diff(crossings(q)).mean() * 1e-3 == pytest.approx(wanted, rel=1e-5)
    energy = 0.5 * inertia * v**2 - mass * WEIGHT * arm * np.cos(q)
    assert np.ptp(energy) < 1e-9 * mass * WEIGHT * arm


def test_belt_mode_frequency_matches_the_closed_form(free):
    J, m, n, k = 4e-5, 1.5, 0.0127, 8e4
    machine = {
        "bodies": {"motor": {"inertia": J}, "carriage": {"mass": m}},
        "joints": {"belt": {"from": "motor", "to": "carriage", "ratio": n, "stiffness": k, "damping": 0.0}},
    }
    states = free(machine, 0.0, [0.1, 0.0], 2000)
    e = states[:, 1] - n * states[:, 0]
    assert 1.0 / (np.diff(crossings(e)).mean() * 1e-3) == pytest.approx(
        math.sqrt(k * (1.0 / m + n * n / J)) / (2.0 * math.pi), rel=1e-4
    )
    momentum = J / n * states[:, NB] + m * states[:, NB + 1]
    assert np.abs(momentum).max() < 1e-9


@pytest.mark.parametrize("inductance", [None, 4e-4])
def test_terminal_speed_of_a_voltage_driven_motor(free, inductance):
    K, R, B, F, V = 0.06, 1.1, 2e-5, 0.008, 12.0
    drive = {"body": "rotor", "column": "u", "kind": "voltage", "gain": 2.0, "limit": 12.0, "resistance": R,
             "torque_constant": K} | ({"inductance": inductance} if inductance else {})  # fmt: skip
    machine = {"bodies": {"rotor": {"inertia": 2e-4, "dry": F, "viscous": B}}, "drives": {"bridge": drive}}
    v = free(machine, V / 2.0, [], 3000)[:, NB]
    assert v[-1] == pytest.approx((K * V / R - F) / (K * K / R + B), rel=1e-5)


def test_rigid_joint_couples_the_bodies_and_carries_the_load(free):
    n, mass, J = 0.05, 4.0, 0.01
    machine = {
        "bodies": {"drum": {"inertia": J}, "load": {"mass": mass, "gravity": {"incline": math.pi / 2}}},
        "joints": {"rope": {"from": "drum", "to": "load", "ratio": n}},
    }
    states = free(machine, 0.0, [], 500)
    fall = -0.5 * mass * WEIGHT * n / (J + n * n * mass) * 0.499**2
    assert states[-1, 0] == pytest.approx(fall, rel=1e-9)
    assert states[-1, 1] == pytest.approx(n * fall, rel=1e-9)


def test_dry_friction_holds_below_its_level_and_slips_above(free):
    drive = {"body": "slide", "column": "u", "kind": "force", "gain": 1.0, "limit": 10.0}
    machine = {"bodies": {"slide": {"mass": 2.0, "dry": 3.0}}, "drives": {"amplifier": drive}}
    held = free(machine, 2.9, [], 2000)
    assert np.abs(held[:, 0]).max() < 1e-6
    assert np.ptp(held[-500:, 0]) < 1e-12
    assert free(machine, 4.0, [], 1001)[-1, NB] == pytest.approx(0.5 * 0.999, rel=1e-3)  # one tick of delay


def test_hysteresis_dissipates_energy(free):
    """A joint between a body and a heavy body rings down with hysteresis and keeps ringing without."""

    def losing(m):
        m["j_H"][0], m["j_z0"][0] = 2.0, 0.01

    machine = {
        "bodies": {"motor": {"inertia": 0.01}, "wall": {"inertia": 1e6}},
        "joints": {"gear": {"from": "motor", "to": "wall", "ratio": 1.0, "stiffness": 40.0, "damping": 0.0}},
    }
    kept, lost = free(machine, 0.0, [0.05], 2000), free(machine, 0.0, [0.05], 2000, losing)
    assert np.abs(kept[-200:, 0]).max() > 0.049
    assert np.abs(lost[-200:, 0]).max() < 0.03


def test_halving_the_step_changes_every_reading_by_less_than_a_tenth_of_a_count(machines):
    for name, (s, run) in machines.items():
        played = np.zeros((s.n, 2))
        for d, column in enumerate(s.commands):
            played[:, d] = run[column]
        n = min(s.n, int(0.8 / s.Ts))
        s.ref, s.w, whole = s.ref[:n], s.w[:n], (s.ref, s.w)
        exact = []
        for sub in (1.0, 2.0):
            m = s.m.copy()
            m["sub"] *= sub
            kept, s.m = s.m, m
            settle, s.settle = s.settle, 0
            exact.append(sim.simulate(s, [1], played[:n])["exact"])
            s.m, s.settle = kept, settle
        s.ref, s.w = whole
        assert np.abs(exact[0] - exact[1]).max() < 0.1, name


def test_every_topology_has_a_machine_that_moves(machines):
    from rtctl.proof.machines import TOPOLOGIES

    assert set(machines) == set(TOPOLOGIES)
    for s, run in machines.values():
        assert s.m["sub"] >= 20
        for column, quantum in s.columns:
            assert np.ptp(run[column]) > 20.0 * quantum
            if quantum == 1.0:
                assert run[column][0] == pytest.approx(0.0, abs=2.0)
