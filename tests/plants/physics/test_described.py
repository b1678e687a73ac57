"""Terms of described machines against their equations, on the linear axis.

The axis runs uncompiled, substep by substep, with the code lines of the term at their sites.
"""

import importlib
import math
from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from rtctl.idiom import interpreted
from rtctl.plants import axis, linear
from rtctl.plants.graph import plant as graph
from rtctl.plants.physics import TERMS, anywhere, by_kind, friction_position, sensor_lag
from rtctl.plants.physics.sensor_lag import SensorLagSettings
from rtctl.plants.physics.term import SITES

M, K, F_C, SPRING = 2.0, 5.0, 0.4, 300.0
USUAL: dict[str, dict[str, Any]] = {
    "transmission.hysteresis": {"F_h": 0.8, "z_h": 2e-3},
    "ripple.ratio": {"A": 1e-3, "phi": 0.3, "turn": 0.02},
    "ripple.torque": {"A": 0.2, "per_turn": 1.0, "phi": 0.5, "turn": 0.02},
    "drive.slew": {"rate": 20.0},
    "sensor.lag": {"tau": 4e-3},
    "load.gravity": {"A": 0.8, "phi": 0.4},
    "load.inertia": {"A": 0.5, "phi": 0.2, "order": 40.0},
    "friction.position": {"A": 0.3, "length": 0.05},
    "drive.back_emf": {"b": 4.0},
}
NOTHING = {"drive.slew": {"rate": 1e9}, "transmission.hysteresis": {"F_h": 0.0}, "sensor.lag": {"tau": 0.0}}
NOTHING |= {"drive.back_emf": {"b": 0.0}}
NAMES = tuple(USUAL)
PASSIVE = ("transmission.hysteresis", "ripple.ratio", "load.gravity", "load.inertia", "friction.position")
TEXT = """
def run(P, S, p, s, i, r, l, c, volts, out):
    m = s.m
    for k in range(len(volts)):
        m.volts[0] = volts[k]
        {command}
        m.u[0] = m.volts[0]
        linear.midpoint(m)
        {force}
        {last}
        linear.advance(m)
        graph.read(p.graph, s.m)
        {reading}
        out[k] = m.x[0], m.x[1], m.y[0], m.u[0], m.f[0], m.dry[0], m.r[0], m.volts[0]
"""


class Run(NamedTuple):
    """Rows (n,) after each substep, and the machine."""

    x: np.ndarray
    v: np.ndarray
    y: np.ndarray
    u: np.ndarray
    f: np.ndarray
    dry: np.ndarray
    r: np.ndarray
    volts: np.ndarray
    m: Any


def run(name: str | None, volts: np.ndarray, h: float, v: float = 0.0, dry: float = F_C, **values: Any) -> Run:
    """Run of the axis with initial speed `v`, with term `name` or without a term."""
    p = axis.build(axis.AxisSettings(parameters={"M": M, "K": K, "F_v": 0.0, "F_c": dry, "k": SPRING}), h)
    s = np.zeros(1, axis.AXIS_STATE).view(np.recarray)[0]
    graph.start(p.graph, s)
    s.m.x[1] = s.m.v_before[0] = v
    lines, scope, params, memory = dict.fromkeys(SITES, "pass"), {"linear": linear, "graph": graph}, None, None
    if name is not None:
        term = TERMS[name]
        fill = {"p": "P", "s": "S", "m": "m", "i": "i", "r": "r", "l": "l", "k": "-1", "c": "c"}
        lines = {site: (term.act_at(site, "axis") or "pass").format(**fill) for site in SITES}
        module = importlib.import_module(term.build.__module__)
        scope[module.__name__.rpartition(".")[2]] = module
        params = term.build(term.settings(node=anywhere(term)["axis"][0], **values), h)
        memory = np.zeros(1, term.state if term.state is not None else [("spare", "f8")]).view(np.recarray)[0]
    exec(TEXT.format(**lines), scope)
    out = np.zeros((len(volts), 8))
    with interpreted():
        scope["run"](params, memory, p, s, 0, 1.0, 0, 0, volts, out)
    return Run(*out.T, s.m)


def push(n: int = 240, h: float = 1e-3) -> np.ndarray:
    """Volts (n,) for a reciprocating motion of n substeps of `h` s."""
    t = np.arange(n) * h
    return 1.2 * np.sign(np.sin(2 * np.pi * 5.0 * t) + 0.2) + 0.3 * np.sin(2 * np.pi * 11.0 * t)


@cache
def plain(times: int) -> np.ndarray:
    """Readings of the axis without a term, with `times` substeps per substep."""
    return run(None, np.repeat(push(), times), 1e-3 / times).y


@pytest.mark.parametrize("name", NAMES)
def test_size_zero_has_no_effect_and_typical_size_is_visible(name):
    off = NOTHING.get(name, {"A": 0.0})
    with_none, with_it = (run(name, push(), 1e-3, **{**USUAL[name], **change}) for change in (off, {}))
    assert np.abs(with_none.y - plain(1)).max() < 1e-9
    assert np.abs(with_it.y - plain(1)).max() > 2e-5


@pytest.mark.parametrize("name", NAMES)
def test_effect_converges_with_the_step_size(name):
    def effect(times):
        volts, h = np.repeat(push(), times), 1e-3 / times
        return (run(name, volts, h, **USUAL[name]).y - plain(times))[times - 1 :: times]

    one, two, exact = (effect(times) for times in (1, 2, 4))
    size = np.abs(exact).max()
    assert np.abs(two - exact).max() < 0.03 * size
    assert np.abs(two - exact).max() < 0.6 * np.abs(one - exact).max() + 1e-4 * size


@pytest.mark.parametrize("name", PASSIVE)
def test_passive_term_does_not_increase_the_energy(name):
    r = run(name, np.zeros(1500), 2e-4, v=0.15, dry=0.0 if name != "friction.position" else F_C, **USUAL[name])
    energy = 0.5 * M * r.v**2 + 0.5 * SPRING * r.x**2
    slack = 2 * USUAL[name]["A"] if name == "load.gravity" else 0.0  # range of the potential energy
    if name == "load.inertia":
        term = USUAL[name]
        energy = energy + 0.5 * term["A"] * np.cos(term["order"] * r.x + term["phi"]) * r.v**2
        assert energy == pytest.approx(energy[0], rel=2e-3)
    elif name == "ripple.ratio":
        x = 2 * np.pi * r.x / 0.02
        error = 1e-3 * (np.sin(x + 0.3) - np.sin(0.3))
        energy = 0.5 * M * r.v**2 + 0.5 * SPRING * (r.x + error) ** 2
        assert energy == pytest.approx(energy[0], rel=2e-3)
    else:
        assert energy.max() < (0.5 * M * 0.15**2 + slack) * 1.001


def test_terms_of_described_machines_are_not_offered_to_the_plants():
    assert all(by_kind(TERMS[name]) == {} and TERMS[name].in_format(2) and not TERMS[name].tabled for name in NAMES)
    assert TERMS["friction.quadratic"].in_format(2) and not TERMS["friction.quadratic"].tabled


@pytest.mark.parametrize("form", ["dahl", "bouc_wen"])
def test_hysteresis_step_is_exact_and_independent_of_the_step_count(form):
    """64 small deflection steps give the result of one large step."""
    from rtctl.plants.physics.hysteresis import bend, bouc_wen

    law = (bend if form == "dahl" else bouc_wen).py_func
    with interpreted():
        for start, way in ((0.0, 3e-3), (0.9, -5e-3), (-0.7, 1e-3)):
            w = start
            for _ in range(64):
                w = law(w, way / 64, 2e-3)
            assert w == pytest.approx(law(start, way, 2e-3), abs=1e-12)
            assert -1.0 <= w <= 1.0
        slope = law(0.3, 1e-9, 2e-3) - 0.3
    assert slope == pytest.approx(1e-9 / 2e-3 * (1.0 - 0.3 ** (1 if form == "dahl" else 2)), rel=1e-4)


def test_hysteresis_loop_dissipates_energy():
    slow = 0.25 * np.sin(2 * np.pi * np.arange(2000) * 1e-3)
    r = run("transmission.hysteresis", slow, 1e-3, dry=0.0, F_h=0.3, z_h=5e-4)
    lost = float(np.sum(-r.f[1000:] * np.diff(r.x, prepend=0.0)[1000:]))
    span = np.ptp(r.x[1000:])
    assert 0.5 < lost / (2 * 0.3 * span) < 1.0  # the bound is the rectangle of a full loop


def test_torque_ripple_modulates_the_gain_with_the_angle():
    r = run("ripple.torque", np.full(300, 2.0), 1e-3, **USUAL["ripple.torque"])
    x = np.concatenate([[0.0], r.x[:-1]])
    v = np.concatenate([[0.0], r.v[:-1]])
    q = 2 * np.pi * (x + 0.5e-3 * v) / 0.02
    assert r.volts == pytest.approx(2.0 * (1 + 0.2 * np.sin(q + 0.5)))


def test_slew_rate_limit_gives_a_ramp():
    r = run("drive.slew", np.full(100, 1.0), 1e-3, rate=20.0)
    assert r.volts[:50] == pytest.approx((np.arange(50) + 0.5) * 0.02)
    assert r.volts[50:] == pytest.approx(1.0)


ORDERS = [{}, {"order": 2, "zeta": 0.4}, {"order": 2, "zeta": 1.0}, {"order": 2, "zeta": 1.7}]


@pytest.mark.parametrize("order", ORDERS)
def test_sensor_lag_filters_the_reading_and_not_the_motion(order):
    r = run("sensor.lag", np.zeros(400), 1e-3, v=0.2, dry=0.0, tau=4e-3, **order)
    t, w = np.arange(1, 401) * 1e-3, math.sqrt(SPRING / M)
    second = (4e-3j * w / (2.0 * order["zeta"])) ** 2 if order else 0.0
    z = 1.0 / (1.0 + 4e-3j * w + second)  # filter response at the oscillation frequency
    steady = 0.2 / w * np.imag(z * np.exp(1j * w * t))
    assert r.y[200:] == pytest.approx(steady[200:], abs=2e-6)
    assert r.x == pytest.approx(0.2 / w * np.sin(w * t), abs=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_sensor_lag_does_not_depend_on_the_number_of_readings(order):
    behind = []
    with interpreted():
        p = sensor_lag.build_sensor_lag(SensorLagSettings(node="s", tau=5e-3, **order), 1e-3)
        for steps in (1, 3, 10):
            s = SimpleNamespace(d=0.0, g=0.0, x=0.0, t=0.0, begun=0)
            sensor_lag.show(p, s, 0.0, 0.0)
            for t in np.arange(1, steps + 1) * 0.02 / steps:
                shown = sensor_lag.show(p, s, 3.0 * t, t)
                assert sensor_lag.show(p, s, 3.0 * t, t) == shown  # second reading at the same time
            behind.append(3.0 * 0.02 - shown)
        assert behind == pytest.approx([behind[0]] * 3)
        swings = 0.4 if order else 1e-6  # order 2 after four time constants
        assert behind[0] == pytest.approx(3.0 * 5e-3 * (1.0 - math.exp(-4.0)), rel=swings)
        assert sensor_lag.show(p, s, 1.0, 0.0) == pytest.approx(1.0 + s.d)  # restarted clock


@pytest.mark.parametrize(("form", "low", "there", "high"), [("step", 0.0, 0.15, 0.3), ("spot", 0.0, 0.3, 0.0)])
def test_position_dependent_friction_as_step_and_as_spot(form, low, there, high):
    settings = friction_position.PositionSettings(node="axis", A=0.3, length=0.02, form=form, at=0.5)
    with interpreted():
        p = friction_position.build_position(settings, 1e-3)
        assert [friction_position.along(p, x) for x in (0.3, 0.5, 0.7)] == pytest.approx([low, there, high], abs=1e-9)


def test_gravity_is_periodic_in_the_angle_or_constant_on_an_incline():
    r = run("load.gravity", push(), 1e-4, **USUAL["load.gravity"])
    assert r.f == pytest.approx(-0.8 * np.sin(r.x + 0.4), abs=1e-4)
    slide = run("load.gravity", push(), 1e-4, A=0.8, form="incline")
    assert slide.f == pytest.approx(-0.8)


def test_position_dependent_friction_adds_to_the_dry_friction():
    r = run("friction.position", push(), 1e-4, A=0.3, length=0.05, slope=2.0)
    assert r.dry == pytest.approx(F_C + 2.0 * r.x + 0.3 * np.sin(2 * np.pi * r.x / 0.05), abs=1e-3)
    assert (np.abs(r.r) <= np.maximum(r.dry, 0.0) + 1e-12).all()


def test_back_emf_brakes_only_a_drive_under_command():
    volts = np.concatenate([np.full(100, 1.5), np.zeros(100)])
    r = run("drive.back_emf", volts, 1e-4, b=4.0)
    assert r.f[1:100] == pytest.approx(-4.0 * r.v[1:100], rel=0.1, abs=1e-3)
    assert (r.f[100:] == 0.0).all()


def test_angle_dependent_inertia_at_rest_accelerates_by_its_local_value():
    for phi in (0.0, math.pi / 2, math.pi):
        r = run("load.inertia", np.full(20, 1.0), 1e-4, A=0.8, phi=phi, order=1.0)
        heavy = M + 0.8 * math.cos(phi)
        assert r.v[-1] == pytest.approx((K * 1.0 - F_C) / heavy * 2e-3, rel=5e-3)
