"""Drive lag and thermal derating: exact responses for any step, no effect at size zero."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.idiom import interpreted
from rtctl.plants import axis, ivu, ldu
from rtctl.plants.physics import drive_dynamics, place
from rtctl.plants.physics.drive_dynamics import LagSettings, ThermalSettings, build_lag, build_thermal


def zeros(dtype: np.dtype) -> np.record:
    return np.zeros(1, dtype).view(np.recarray)[0]


def step_response(t: np.ndarray, tau: float, order: int, zeta: float) -> np.ndarray:
    """Closed-form response of the lag to a step of 1 V at t = 0."""
    if order == 1:
        return 1 - np.exp(-t / tau)
    x = 2.0 * zeta * t / tau
    d = np.sqrt(complex(1 - zeta**2))
    return (1 - np.exp(-zeta * x) * (np.cos(d * x) + zeta / d * np.sin(d * x))).real


@settings(deadline=None)
@given(st.floats(1e-4, 1e-1), st.sampled_from([1, 2]), st.sampled_from([0.1, 0.7, 1.5, 6.0]), st.floats(1e-4, 1e-2))
def test_lag_outputs_the_mean_response_over_each_substep(tau, order, zeta, h):
    h = min(h, 20.0 * tau / max(2.0 * zeta, 1.0))  # beyond, the closed form below overflows
    p, s = build_lag(LagSettings(node="drive", tau=tau, order=order, zeta=zeta), h), zeros(drive_dynamics.LAG_STATE)
    fine = np.linspace(0, h, 4001)
    for k in range(5):
        response = step_response(fine + k * h, tau, order, zeta)
        assert drive_dynamics.lag(p, s, 1.0) == pytest.approx(np.trapezoid(response, fine) / h, rel=1e-4, abs=1e-5)
    assert s.y == pytest.approx(step_response(np.array([5 * h]), tau, order, zeta)[0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("zeta", [0.3, 1.0, 1.0 + 1e-9, 3.0])
def test_lag_vanishes_linearly_with_tau_and_settles_at_the_command(order, zeta):
    def first(tau: float) -> float:
        p = build_lag(LagSettings(node="drive", tau=tau, order=order, zeta=zeta), 1e-3)
        return float(drive_dynamics.lag(p, zeros(drive_dynamics.LAG_STATE), 1.0))

    assert first(0.0) == 1.0
    change = [1.0 - first(tau) for tau in (1e-9, 1e-6, 1e-5)]
    assert change[0] < 1e-5 and change[0] < change[1] < change[2]
    assert change[2] / change[1] == pytest.approx(10.0, rel=1e-3)  # proportional to tau, smooth for a fit
    p, s = build_lag(LagSettings(node="drive", tau=0.01, order=order, zeta=zeta), 1e-3), zeros(drive_dynamics.LAG_STATE)
    out = [drive_dynamics.lag(p, s, 2.0) for _ in range(1000)]
    assert out[-1] == pytest.approx(2.0, rel=1e-4)


def test_lag_is_continuous_across_critical_damping():
    out = []
    for zeta in (0.999, 1.0, 1.001):
        p, s = build_lag(LagSettings(node="drive", tau=0.01, order=2, zeta=zeta), 1e-3), zeros(drive_dynamics.LAG_STATE)
        out.append([drive_dynamics.lag(p, s, 1.0) for _ in range(20)])
    assert np.allclose(out[1], 0.5 * (np.array(out[0]) + np.array(out[2])), atol=1e-6)


def warm(node: str, a: float = 0.5, tau: float = 2.0) -> tuple:
    p = build_thermal(ThermalSettings(node=node, a=a, tau=tau, V_ref=2.0), 1e-2)
    return p, zeros(drive_dynamics.THERMAL_STATE)


def test_thermal_gain_falls_under_load_and_recovers():
    p, s = warm("drive")
    gains = []
    for k in range(2000):
        u = np.array([2.0 if k < 1000 else 0.1])
        was = u[0]
        drive_dynamics.thermal_gain(p, s, u, p.channel, p.gain)
        gains.append(u[0] / was)
    assert gains[0] == 1.0
    assert gains[200] == pytest.approx(math.exp(-0.5 * (1 - math.exp(-1.0))), rel=1e-9)  # after tau
    assert gains[999] == pytest.approx(math.exp(-0.5), rel=1e-2)
    assert gains[-1] > 0.98
    assert drive_dynamics.thermal_friction(p, s, 3.0, p.friction) == 3.0  # a term at a drive does not change friction


@pytest.mark.parametrize(
    ("form", "left"), [("exponential", math.exp(-0.5)), ("linear", 0.5), ("hyperbolic", 1.0 / 1.5)]
)
def test_final_thermal_gain_of_each_loss_form(form, left):
    def gain(a: float, volts: float = 2.0) -> float:
        p = build_thermal(ThermalSettings(node="drive", a=a, tau=2.0, V_ref=2.0, form=form), 1e-2)
        s = zeros(drive_dynamics.THERMAL_STATE)
        for _ in range(4000):
            u = np.array([volts])
            drive_dynamics.thermal_gain(p, s, u, p.channel, p.gain)
        return u[0] / volts

    assert gain(0.5) == pytest.approx(left, rel=1e-6)
    assert gain(0.01) == pytest.approx(0.99, rel=1e-3)  # the forms agree for a small loss
    assert 0.0 < gain(2.0, 20.0) < 0.1  # the gain never becomes negative


def test_thermal_term_at_a_motor_lowers_friction_and_keeps_the_gain():
    p, s = warm("motor2")
    for _ in range(200):
        u = np.array([9.0, 2.0])
        drive_dynamics.thermal_gain(p, s, u, p.channel, p.gain)
        assert list(u) == [9.0, 2.0]
    assert drive_dynamics.thermal_friction(p, s, 3.0, p.friction) == pytest.approx(
        3.0 * math.exp(-0.5 * (1 - math.exp(-1.0)))
    )


def test_thermal_ease_of_a_drive_lowers_the_friction_of_its_motor():
    p = build_thermal(ThermalSettings(node="drive2", a=0.0, ease=0.4, tau=2.0, V_ref=2.0), 1e-2)
    s = zeros(drive_dynamics.THERMAL_STATE)
    for _ in range(4000):
        u = np.array([0.0, 2.0])
        drive_dynamics.thermal_gain(p, s, u, p.channel, p.gain)
    assert list(u) == [0.0, 2.0]
    assert drive_dynamics.thermal_friction(p, s, 3.0, p.friction) == pytest.approx(3.0 * math.exp(-0.4), rel=1e-6)
    assert [place(*at).node for at in (("ivu", "drive1"), ("ivu", "drive2"), ("ldu", "drive"), ("axis", "drive"))] == [
        ivu.MOTOR1, ivu.MOTOR2, ldu.CAPSTAN, axis.CARRIAGE,
    ]  # fmt: skip


def test_thermal_gain_of_a_drive_depends_only_on_its_command():
    u = np.tile([0.5, 3.0], (500, 1))
    base = stand.run("ivu", [], u).x[-1]
    for node, i, other in (("drive1", 10, 12), ("drive2", 12, 10)):
        term = stand.make("drive.thermal", "ivu", node, a=0.3, tau=0.1, V_ref=1.0)
        x = stand.run("ivu", [term], u).x[-1]
        volts = u[0, (i - 10) // 2]
        assert x[i] / base[i] == pytest.approx(math.exp(-0.3 * volts**2), rel=1e-3)
        assert x[other] == pytest.approx(base[other], rel=1e-9)


def test_thermal_term_acts_on_a_drive_of_any_name():
    import machine

    r = machine.run(machine.SCREW, [machine.settings("drive.thermal", "amplifier", a=0.4, tau=0.05)], np.ones(400))
    assert r.u[0, 0] == 1.0
    assert r.u[-1, 0] == pytest.approx(math.exp(-0.4), rel=1e-3)


def test_thermal_friction_of_a_body_depends_on_all_drives():
    p, s = warm("carriage", a=0.4)
    m = SimpleNamespace(nu=2, volts=np.array([2.0, 0.0, 0.0, 0.0]), dry=np.array([3.0, 5.0]))
    before = m.volts.copy()
    with interpreted():
        for _ in range(2000):
            drive_dynamics.thermal_gain(p, s, m.volts, -1, p.a)
            left = drive_dynamics.thermal_dry(p, s, m, 1, -1)
        at_a_drive = drive_dynamics.thermal_dry(p, zeros(drive_dynamics.THERMAL_STATE), m, 1, 0)
    assert left == pytest.approx(5.0 * math.exp(-0.4), rel=1e-3)
    assert (m.volts == before).all()  # a term at a body does not change the command
    assert at_a_drive == 5.0  # at a drive only `ease` lowers friction
