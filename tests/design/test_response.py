"""Frequency responses agree with the coefficients of the tick and with the plant of the emulator."""

import fused
import numpy as np
import pytest
from scipy import signal

from rtctl import machines
from rtctl.config.errors import UserError
from rtctl.config.load import set_path
from rtctl.design import response
from rtctl.laws import pd, pi_velocity, sections, velocity
from rtctl.plants import ldu

F = np.array([0.7, 3.0, 11.0, 40.0, 90.0])


def sine_response(step, f: float, dt: float) -> complex:
    """Response of a law stepped with a sine, measured over an integer number of final periods."""
    n = round(200 / (f * dt))
    t = np.arange(n) * dt
    y = np.array([step(x) for x in np.cos(2 * np.pi * f * t)])
    last = slice(n - round(20 / (f * dt)), n)
    turn = np.exp(-2j * np.pi * f * t[last])
    columns = np.stack([turn.conj().real, -turn.conj().imag, np.ones(len(turn))], axis=1)
    a, b, _ = np.linalg.lstsq(columns, y[last], rcond=None)[0]
    return complex(a, b)


def test_response_of_the_pd_agrees_with_the_stepped_law():
    config = fused.config("ivu")
    p, s = pd.build(config.law.position, 2e-3), np.zeros(1, pd.PD_STATE)[0]
    for f in (3.0, 40.0):
        got = sine_response(lambda e: pd.step(p, s, e), f, 2e-3)
        assert response.law(config, np.array([f]))[0] == pytest.approx(got, rel=2e-3)


def test_response_of_the_pi_with_velocity_agrees_with_the_stepped_law():
    config = fused.config("ldu", law__position__tau_i=None)
    p, v = pi_velocity.build(config.law.position, 1e-4), velocity.build(config.law.velocity, 1e-4)
    s = np.zeros(1, pi_velocity.PI_VELOCITY_STATE)[0]
    sv = np.zeros(1, velocity.VELOCITY_STATE)[0]
    got = sine_response(lambda x: pi_velocity.step(p, s, x, -velocity.step(v, sv, x)), 100.0, 1e-4)
    assert response.law(config, np.array([100.0]))[0] == pytest.approx(got, rel=5e-3)


def test_integral_part_of_the_law():
    config = fused.config("ldu")
    with_it, without = (response.law(c, F) for c in (config, set_path(config, "law.position.tau_i", None)))
    back = np.exp(-2j * np.pi * F * 1e-4)
    np.testing.assert_allclose(with_it - without, 6400 * 1e-4 / 4.0 / (1 - back), rtol=1e-9)


def test_response_of_the_sections_agrees_with_scipy():
    law = {"kind": "sections", "sections": [{"kind": "lead_lag", "k": 8e4, "alpha": 0.05, "tau_I": 8, "beta": 20,
           "tau_D": 2e-3}, {"kind": "notch", "frequency": 110, "zeta_z": 0.1, "zeta_p": 0.6}]}  # fmt: skip
    config = set_path(fused.config("ldu"), "law.position", law)
    built = sections.build(config.law.position, 1e-4)
    wanted = np.ones(len(F), complex)
    for p in built:
        wanted *= signal.freqz([p.b0, p.b1, p.b2], [1, p.a1, p.a2], worN=F, fs=1e4)[1]
    np.testing.assert_allclose(response.law(config, F), wanted, rtol=1e-9)


def test_plant_response_agrees_with_the_state_space_of_the_emulator():
    config = fused.config("ldu")
    p = next(b.params for b in machines.build(config).plant_diagram.blocks if b.name == "plant")
    A, B = ldu.state_space(p)
    wanted = [np.linalg.solve(2j * np.pi * f * np.eye(ldu.NX) - A, B[:, 0])[ldu.ENCODER] * 0.1 * 3e-3 for f in F]
    np.testing.assert_allclose(response.plant(config, F), wanted, rtol=1e-6)


def test_scale_measures_the_carriage_and_encoder_the_shaft():
    f = np.array([5.0, 270.0])
    shaft, carriage = (response.plant(fused.config("ldu", sensors__feedback=s), f) for s in ("encoder", "scale"))
    assert shaft[0] == pytest.approx(carriage[0], rel=1e-2)
    assert abs(carriage[1]) < 0.3 * abs(shaft[1])  # anti-resonance of the carriage


def test_process_gain_is_that_of_the_thesis():
    """8.2: K_p = 25.4 at 1 Hz, per ampere."""
    P = response.plant(fused.config("ivu"), np.array([1.0]))
    assert abs(P[0]) * (2 * np.pi) ** 2 / 0.2 == pytest.approx(25.4, rel=0.03)


def test_axis_is_a_mass_with_viscous_friction():
    s = 2j * np.pi * F
    np.testing.assert_allclose(response.plant(fused.config("axis"), F), 35.15 / (95.1 * s**2 + 203.5 * s), rtol=1e-9)


def test_allocation_selects_the_motors_of_the_plant_response():
    one, two = (response.plant(fused.config("ivu"), F, motor) for motor in (1, 2))
    both = response.plant(fused.config("ivu", law__allocation__kind="differential"), F)
    np.testing.assert_allclose(both, (one + two) / 2, rtol=1e-9)
    for motor, kind in ((one, "motor1"), (two, "motor2")):
        np.testing.assert_allclose(response.plant(fused.config("ivu", law__allocation__kind=kind), F), motor)


def test_gain_schedule_is_part_of_the_law_response():
    radii = {"radius__R1": 0.04, "radius__R2": 0.04}
    floor = {"law__gain_schedule__floor": 0.0}
    fixed, led = (
        response.law(fused.config("ivu", law__gain_schedule__mode=m, **floor, **radii), F) for m in ("off", "model")
    )
    assert 0.3 < abs(led[0] / fixed[0]) < 0.7


def test_write_at_the_next_tick_adds_one_tick_of_delay():
    late, soon = (response.loop(fused.config("ivu", loop__write=w), F) for w in ("next_tick", "same_tick"))
    np.testing.assert_allclose(late / soon, np.exp(-2j * np.pi * F * 2e-3), rtol=1e-9)


def test_printed_law_has_a_delay_of_three_milliseconds():
    config = fused.config("ivu")
    s = 2j * np.pi * F
    wanted = response.plant(config, F) * 31 * (1 + 0.16 * s) * np.exp(-3e-3 * s)
    np.testing.assert_allclose(response.printed(config, F), wanted, rtol=1e-9)
    with pytest.raises(UserError, match="pi_velocity"):
        response.printed(fused.config("ldu"), F)
