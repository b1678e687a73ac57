import numpy as np
import pytest

from rtctl.laws import disturbance_observer as observer

DT, K = 0.001, 50.0
SETTINGS = observer.DisturbanceObserverSettings(bandwidth=5.0, acceleration=K, delay=1)
P = observer.build(SETTINGS, DT)


def held(push, ticks, share=1.0, known=0.0, delay=1):
    """Position and observer state after `ticks` of a double integrator under PD with a disturbance of `push` V."""
    p = observer.build(SETTINGS.model_copy(update={"share": share, "delay": delay}), DT)
    s = np.zeros(1, observer.DISTURBANCE_OBSERVER_STATE)[0]
    x = v = u = 0.0
    commands = [0.0] * delay
    for _ in range(ticks):
        against = observer.step(p, s, x)
        u = -20.0 * x - 1.5 * v + against + known
        observer.track(p, s, u, known, 0.0)
        acting, commands = (commands[0], [*commands[1:], u]) if delay else (u, [])
        a = K * (acting + push)
        x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
    return x, s


def test_observer_estimates_and_cancels_a_constant_force():
    x, s = held(0.4, 3000)
    assert s["d"] / K == pytest.approx(0.4, rel=1e-6)
    assert abs(x) < 1e-8
    assert held(0.4, 3000, share=0.0)[0] == pytest.approx(0.4 / 20.0, rel=1e-3)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_observer_accounts_for_the_command_delay(delay):
    _, s = held(0.4, 3000, delay=delay)
    assert s["d"] / K == pytest.approx(0.4, rel=1e-6)


def test_force_cancelled_by_the_feedforward_is_not_compensated_twice():
    x, s = held(0.4, 3000, known=-0.4)
    assert s["d"] / K == pytest.approx(0.0, abs=1e-9)
    assert abs(x) < 1e-9


def test_analytic_response_to_the_position_matches_the_ticks():
    f = 3.0
    n = round(1 / (f * DT))
    y = np.exp(2j * np.pi * f * DT * np.arange(60 * n))
    outs = []
    for part in (y.real, y.imag):
        s = np.zeros(1, observer.DISTURBANCE_OBSERVER_STATE)[0]
        out = []
        for value in part:
            out.append(observer.step(P, s, value))
            observer.track(P, s, 0.0, 0.0, 0.0)
        outs.append(np.array(out))
    seen = (outs[0] + 1j * outs[1])[-1] / y[-1]
    to_y, _ = observer.response(P, np.array([f]))
    assert -to_y[0] == pytest.approx(seen, rel=1e-3)


def test_analytic_response_to_the_command_matches_the_ticks():
    f = 3.0
    u = np.exp(2j * np.pi * f * DT * np.arange(20_000))
    outs = []
    for part in (u.real, u.imag):
        s = np.zeros(1, observer.DISTURBANCE_OBSERVER_STATE)[0]
        s["primed"] = 1
        out = []
        for value in part:
            out.append(observer.step(P, s, 0.0))
            observer.track(P, s, value, 0.0, 0.0)
        outs.append(np.array(out))
    seen = (outs[0] + 1j * outs[1])[-1] / u[-1]
    assert observer.response(P, np.array([f]))[1][0] == pytest.approx(seen, rel=1e-3)


def test_observer_accounts_for_different_gains_of_the_two_drives():
    settings = SETTINGS.model_copy(update={"acceleration_back": 0.5 * K, "delay": 0})
    p, s = observer.build(settings, DT), np.zeros(1, observer.DISTURBANCE_OBSERVER_STATE)[0]
    x = v = 0.0
    for _ in range(4000):
        u = -20.0 * x - 1.5 * v + observer.step(p, s, x)
        observer.track(p, s, u, 0.0, 0.0)
        a = (K if u > 0 else 0.5 * K) * u + 8.0
        x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
    assert s["d"] == pytest.approx(8.0, rel=1e-6)
    assert abs(x) < 1e-8


def test_observer_selects_the_drive_gain_by_the_sign_of_the_command():
    settings = SETTINGS.model_copy(update={"acceleration_back": 0.5 * K, "delay": 0})
    p, s = observer.build(settings, DT), np.zeros(1, observer.DISTURBANCE_OBSERVER_STATE)[0]
    x, v = 0.0, 1.0
    for _ in range(400):  # decelerates: the command is smaller than the friction of 0.4 V
        observer.step(p, s, x)
        observer.track(p, s, 0.1, 0.4, 0.0)
        a = K * (0.1 - 0.4)
        x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
    assert s["d"] == pytest.approx(0.0, abs=1e-2 * K)


def test_known_acceleration_is_not_estimated_as_a_disturbance():
    p, s = (
        observer.build(SETTINGS.model_copy(update={"delay": 0}), DT),
        np.zeros(1, observer.DISTURBANCE_OBSERVER_STATE)[0],
    )
    x = v = 0.0
    for _ in range(400):
        observer.step(p, s, x)
        observer.track(p, s, 0.2, 0.0, 0.3)
        a = K * (0.2 + 0.3)
        x, v = x + DT * v + 0.5 * DT * DT * a, v + DT * a
    assert s["d"] == pytest.approx(0.0, abs=1e-6 * K)


def test_reset_clears_the_observer_state(zero):
    _, s = held(0.4, 300)
    observer.reset(P, s)
    assert s["d"] == 0.0 and not s["a"].any()
    assert observer.step(P, s, 3.0) == 0.0  # the reset observer starts at the present position
