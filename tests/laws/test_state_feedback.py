"""State feedback with an observer: transfer function, steady state, saturation."""

import numpy as np
import pytest

from rtctl.idiom import record_dtype
from rtctl.laws import state_feedback as law

DT = 0.01
MASS = {  # unit mass, unit force per command, one tick of output delay
    "A": [[1.0, DT, DT**2 / 2], [0.0, 1.0, DT], [0.0, 0.0, 0.0]], "B": [0.0, 0.0, 1.0], "C": [1.0, 0.0, 0.0],
    "L": [0.3, 4.0, 0.0], "K": [20.0, 7.0, 0.1], "N": [1.0, 0.0, 0.0], "integral": 8.0, "tau_t": 0.5,
}  # fmt: skip


def made(**changes):
    settings = law.StateFeedbackSettings(**{**MASS, **changes})
    params = law.build(settings, DT)
    p = np.zeros(1, record_dtype(params))
    for name, value in params._asdict().items():
        p[0][name] = value
    return params, p[0], np.zeros(1, law.STATE_FEEDBACK_STATE)[0]


def run(ticks, ref, limit=np.inf, push=0.0):
    """Positions and commands (ticks,) of a mass under the law, with a disturbance `push`."""
    _, p, s = made()
    x = np.zeros(3)
    positions, commands = [], []
    for _ in range(ticks):
        u = law.step(p, s, ref - x[0], x[0], ref)
        written = float(np.clip(u, -limit, limit))
        law.track(p, s, u, written)
        positions.append(x[0])
        commands.append(written)
        x = np.array(MASS["A"]) @ x + np.array(MASS["B"]) * written + np.array([DT**2 / 2, DT, 0.0]) * push
    return np.array(positions), np.array(commands)


def test_state_feedback_reaches_the_reference_and_stays():
    x, u = run(6000, 1.0)
    assert x[-1] == pytest.approx(1.0, abs=1e-6)
    assert u[-1] == pytest.approx(0.0, abs=1e-6)


def test_integral_rejects_a_constant_force():
    x, u = run(4000, 1.0, push=-0.7)
    assert x[-1] == pytest.approx(1.0, abs=1e-4)
    assert u[-1] == pytest.approx(0.7, abs=1e-3)


def test_saturation_does_not_wind_up_the_observer_or_the_integral():
    free, _ = run(3000, 1.0)
    held, _ = run(3000, 1.0, limit=1.0)
    assert held.max() < 1.3 * max(free.max(), 1.0)
    assert held[-1] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("path", ["feedback", "reference"])
def test_analytic_response_matches_the_ticks(path):
    params, p, s = made()
    law.reset(p, s)
    s["primed"] = 1  # estimate of 0, the initial state of a transfer function
    count, out = 4096, []
    for k in range(count):
        signal = 1.0 if k == 0 else 0.0
        x, ref = (-signal, 0.0) if path == "feedback" else (0.0, signal)
        u = law.step(p, s, ref - x, x, ref)
        law.track(p, s, u, u)
        out.append(u)
    f = np.fft.rfftfreq(count, DT)[20:-1:97]
    back = np.exp(-2j * np.pi * f * DT)
    tail = np.array(out) - out[-1]
    told = np.array([np.sum(tail * b ** np.arange(count)) for b in back]) + out[-1] / (1 - back)
    np.testing.assert_allclose(law.response(params, back, path), told, rtol=1e-5)


def test_inconsistent_state_feedback_dimensions_are_refused():
    with pytest.raises(ValueError, match="L has 2 numbers, B has 3"):
        made(L=[0.1, 0.2])
    with pytest.raises(ValueError, match="A is 3 rows of 3 numbers"):
        made(A=[[1.0, 0.0], [0.0, 1.0]])
    with pytest.raises(ValueError, match="the integral would oscillate"):
        made(tau_t=0.001)
    with pytest.raises(ValueError, match="1 to 16 states"):
        made(B=[0.0] * 17)
