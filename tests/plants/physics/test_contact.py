"""Sliding contacts: force limit, creep rate, permanent slip, lag of the strip."""

import bench
import machine
import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants import ivu, linear
from rtctl.plants.physics import contact, ripple_tape

forces = st.floats(-100, 100)


def state(d: float = 0.0) -> np.recarray:
    s = np.zeros(1, contact.CONTACT_STATE).view(np.recarray)[0]
    s.d = d
    return s


@settings(deadline=None)
@given(st.lists(forces, min_size=1, max_size=30), st.floats(0.1, 50), st.floats(1, 1e4), st.floats(0, 10))
def test_slip_bounds_the_force_and_dissipates_energy(pulls, F_max, c, k):
    s = state()
    for T in pulls:
        before = s.d
        F = T + contact.slide(s, F_max, 0.0, T, c, k, 1e-3)
        assert abs(F) <= F_max * (1 + 1e-9) + 1e-9
        assert F * (s.d - before) >= -1e-12


@settings(deadline=None)
@given(st.floats(0.1, 5), st.floats(0.1, 20), st.floats(10, 1e3), st.floats(0.0, 1.0), st.floats(0.01, 1.0))
def test_slip_force_increases_with_sliding_speed(F_max, eta, c, k, v):
    s, h = state(), 1e-3
    for i in range(round(10 * (F_max / (c * v) + (k + eta) / c) / h) + 10):  # both ends part at a steady speed
        T = c * v * (i + 0.5) * h + k * v
        F = T + contact.slide(s, F_max, eta, T, c, k, h)
    assert pytest.approx(F_max + eta * v, rel=0.02) == F


@settings(deadline=None)
@given(forces, st.floats(0, 10), st.floats(1, 1e4), st.floats(0, 10), st.integers(1, 20))
def test_creep_step_is_exact_for_a_constant_pull(T, grip, c, k, n):
    once, often = state(), state()
    contact.micro(once, grip, T, c, k, 1e-2)
    for _ in range(n):
        contact.micro(often, grip, T, c, k, 1e-2 / n)
    assert once.d == pytest.approx(often.d, rel=1e-9, abs=1e-12)
    assert once.d * T >= 0.0 and abs(c * once.d) <= abs(T) * (1 + 1e-12) + 1e-300


def test_strip_creep_is_proportional_to_force_and_travel():
    """Strip under a steady pull: the creep is kappa F times the travel."""
    kappa, term = 1e-3, bench.usual("transmission.creep", "ldu", "capstan", kappa=1e-3)
    r = bench.run("ldu", [term], np.full((400, 1), 0.12))
    way = 3e-3 * r.q[:, 2]
    F = (7.6 * (r.q[:, 1] - r.q[:, 2]) - 7.6 * (r.q[:, 2] - r.q[:, 3]))[300] / 3e-3
    assert (way - r.y[:, 1])[-1] == pytest.approx(kappa * F * way[-1], rel=0.02)


@pytest.mark.parametrize(("current", "slips"), [(0.09, False), (0.4, True)])
def test_strip_slips_above_its_force_limit(current, slips):
    F = 7.3 + 1.25 * (current * 21e-3 * 20 / 3e-3 - 7.3) / 47.1  # most of the push goes into the motor's own inertia
    term = bench.usual("transmission.slip", "ldu", "capstan", F_max=7.7)
    r = bench.run("ldu", [term], np.concatenate([np.linspace(0, current, 200), np.full(200, current)]), B_m=0.0)
    behind = 3e-3 * r.q[:, 2] - r.y[:, 1]
    assert (abs(behind[-1]) > 1e-4) == slips
    if slips:
        rate = np.diff(behind[-100:], 2).mean() / 1e-6
        assert rate == pytest.approx((F - 7.7) / 1.25, rel=0.1)


def test_slip_of_the_strip_stops_and_remains():
    term = bench.usual("transmission.slip", "ldu", "capstan", F_max=7.7)
    r = bench.run("ldu", [term], np.concatenate([np.full(50, 0.4), np.zeros(400)]))
    behind = 3e-3 * r.q[:, 2] - r.y[:, 1]
    assert behind[-1] > 1e-5
    assert np.ptp(behind[-100:]) == 0.0


def test_wheel_slips_at_its_torque_limit():
    term = bench.usual("transmission.slip", "ldu", "wheel", F_max=8e-4)
    r = bench.run("ldu", [term], np.full(200, 0.1))  # 2.1 mNm
    rate = (r.v[-1, 0] - r.v[100, 0]) / 0.099
    assert rate == pytest.approx((2.1e-3 - 8e-4) / 1e-6, rel=0.03)


def test_tape_slides_over_a_blocked_capstan():
    """Bearing friction 5 mNm, contact limit 20 mN or 0.25 mNm: the tape moves and the capstan stays at rest."""
    inputs = np.concatenate([np.full((300, 2), 0.6), np.tile([1.2, 0.2], (1500, 1))])
    stuck = bench.run("ivu", [], inputs, tau_Fc=5e-3)
    r = bench.run("ivu", [bench.usual("transmission.slip", "ivu", F_max=0.02)], inputs, tau_Fc=5e-3)
    assert abs(r.q[-1, 2]) < 1e-3
    assert r.q[-1, 1] * 0.038 > stuck.q[-1, 1] * 0.038 + 5e-3
    assert r.q[-1, 1] * 0.038 == pytest.approx(-r.q[-1, 3] * 0.022, abs=2e-3)  # reel 1 winds the tape of reel 2


def taut(e1: float, e2: float) -> np.recarray:
    """Record of a reel unit at rest with tape elongations e1, e2 (m)."""
    _, plant = stand.plant("ivu", 5e-4, d_tape=0.0)
    plant.m.qm[ivu.REEL1], plant.m.qm[ivu.REEL2] = e1 / plant.m.link_a[0], e2 / plant.m.link_a[1]
    return plant.m


def slipped(m: np.recarray) -> None:
    p = contact.build_slip(contact.SlipSettings(node="capstan", F_max=0.05), 5e-4)
    contact.slip_tape(p, state(), m)


def crept(m: np.recarray) -> None:
    p = contact.build_creep(contact.CreepSettings(node="capstan", kappa=1.0), 5e-4)
    s = state()
    s.d = 3e-4  # all that the tapes differ by, so that nothing is left to creep for
    m.vm[ivu.CAPSTAN] = 1.0
    contact.creep_tape(p, s, m, ivu.CAPSTAN)


@pytest.mark.parametrize(("act", "left"), [(slipped, 0.05), (crept, 0.0)])
def test_tape_tension_and_stretch_include_the_slip(act, left):
    """Load-dependent friction, eccentric wheels and stiffening tape use the tension and stretch of the tape
    after the slip."""
    m = taut(2e-4, 8e-4)
    m.link_k[:] = 0.0  # no damping force of a sudden slip
    act(m)
    T = np.array([linear.tension(m, 0), linear.tension(m, 1)])
    assert T[1] - T[0] == pytest.approx(left, abs=2e-3)
    assert T.sum() == pytest.approx(450.0 * 1e-3)  # the total stretch is conserved
    assert [450.0 * linear.stretch(m, j) for j in (0, 1)] == pytest.approx(list(T), abs=2e-3)
    before = m.f.copy()
    wheel = ripple_tape.build_capstan(ripple_tape.CapstanSettings(node="capstan", a=1e-4), 5e-4)
    ripple_tape.capstan_arm(wheel, m, ivu.CAPSTAN)
    assert (m.f - before)[ivu.CAPSTAN] == pytest.approx(-1e-4 * (T[1] - T[0]))


HELD = {  # a motor, a spring and a hub of very large inertia
    "bodies": {"motor": {"inertia": 1e-3}, "hub": {"inertia": 1e3}},
    "joints": {"clutch": {"from": "motor", "to": "hub", "ratio": 0.5, "stiffness": 100.0, "damping": 2.0}},
    "drives": {"amplifier": {"body": "motor", "column": "u", "kind": "force", "gain": 1.0}},
    "sensors": {"encoder": {"body": "motor", "measures": "position", "column": "counts", "counts_per_unit": 1e6},
                "cell": {"joint": "clutch", "measures": "force", "column": "force", "resolution": 1e-6}},
}  # fmt: skip


def test_joint_creep_rate_is_proportional_to_its_force():
    """A motor torque of 2 Nm loads the joint with T = 4 Nm; the creep rate is `rate` T."""
    r = machine.run(HELD, [machine.settings("transmission.creep", "clutch", rate=0.05)], np.full(600, 2.0))
    assert r.y[-1, 1] == pytest.approx(-4.0, rel=1e-2)
    slid = 0.5 * (r.y[-1, 0] - r.y[-201, 0])  # in the unit of the hub, which hardly moves
    assert slid == pytest.approx(0.05 * 4.0 * 0.2, rel=1e-2)


def test_joint_creep_is_proportional_to_the_travel_of_its_end():
    free = {**HELD, "bodies": {"motor": {"inertia": 1e-3}, "hub": {"inertia": 0.1, "viscous": 2.0}}}
    term = machine.settings("transmission.creep", "clutch", kappa=0.01)
    r, tight = (machine.run(free, terms, np.full(600, 2.0)) for terms in ([term], []))
    way = r.x[-1, 1] - r.x[-201, 1]
    assert way == pytest.approx(tight.x[-1, 1] - tight.x[-201, 1], rel=1e-2)
    lost = 0.5 * (r.x[-1, 0] - r.x[-201, 0]) - way
    assert lost == pytest.approx(0.01 * 4.0 * way, rel=2e-2)


@pytest.mark.parametrize(("push", "slips"), [(1.4, False), (1.7, True)])
def test_joint_slips_above_its_limit(push, slips):
    term = machine.settings("transmission.slip", "clutch", F_max=3.0)
    r = machine.run(HELD, [term], push * np.minimum(np.arange(600) / 300, 1.0))
    assert np.abs(r.y[:, 1]).max() == pytest.approx(3.0 if slips else 2.8, rel=5e-2)
    assert (r.x[-1, 0] - r.x[-101, 0] > 0.1) == slips
