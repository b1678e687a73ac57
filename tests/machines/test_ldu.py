"""Shipped linear drive in fused mode: settling of printing steps, and the loop gain of the thesis."""

from typing import Any

import fused
import numpy as np
import pytest

from rtctl import machines
from rtctl.plants import ldu
from rtctl.tick import safety

STEP = 1e-3 / 12
STEPS = ((0.5, 1), (1.0, 1), (1.5, 1), (2.0, 1), (2.5, -1), (3.0, -1))  # s, direction, of print_steps.yaml
COUNT = 2 * np.pi / 20_000 * 3e-3


@pytest.fixture(scope="module")
def run() -> fused.Run:
    return fused.shipped("ldu", "print_steps", 3.7)


@pytest.mark.parametrize(("begin", "direction"), STEPS)
def test_printing_step_settles(run, begin, direction):
    """The error is within 5 % of the step after 0.16 s, without larger overshoot; the carriage ends at rest."""
    rows = run.between(begin, begin + 0.4998)
    share = 1 + direction * (rows["truth_x"] - rows["target"][-1]) / STEP
    assert abs(share[0]) < 0.05
    assert share.max() < 1.05
    assert np.abs(share[1600:] - 1).max() < 0.05
    assert np.ptp(rows["truth_x"][-500:]) < COUNT


def test_current_follows_the_command_without_a_trip(run):
    assert run["trip"].max() == 0
    assert run["state"][-1] == safety.RUNNING
    assert np.abs(run["u"]).max() < 3.0
    rest = run.between(0.3, 0.5)
    assert rest["truth_current"] == pytest.approx(0.1 * rest["u"], abs=2e-4)


def test_encoder_and_scale_agree_with_the_carriage(run):
    """x = R_c theta_c: the encoder differs by the twist of the capstan, the scale by its pitch."""
    assert np.abs(run["scale"] - run["truth_x"]).max() < 1.1e-6
    assert np.abs(run["position"] - run["truth_x"]).max() < 4 * COUNT
    assert run["encoder_counts"] * COUNT == pytest.approx(run["position"], abs=1e-12)


def test_true_carriage_position_includes_slip_and_guide():
    """The scale measures the carriage position to within its pitch and its periodic errors."""
    terms = [
        {"term": "transmission.slip", "node": "capstan", "F_max": 7.5},
        {"term": "ripple.capstan", "node": "capstan", "a": 2e-5},
        {"term": "guide.thickness", "node": "carriage", "A": 2e-5, "wavelength": 0.02, "phi": 1.0},
    ]
    steps = [{"at": 0.2, "to": 0.01, "ramp": 0.05}]
    changes = {"reference__steps": steps, "safety__disagreement": 0, "safety__following_error": 0}
    run = fused.run(fused.config("ldu", plant__physics=terms, **changes), 2.0)
    assert np.abs(run["scale"] - run["position"]).max() > 1e-5
    assert np.abs(run["scale"] - run["truth_x"]).max() < 2e-6
    wrong = [*terms, {"term": "sensor.scale", "node": "scale", "relative": 0.01}]
    off = fused.run(fused.config("ldu", plant__physics=wrong, **changes), 2.0)
    assert np.abs(off["truth_x"] - run["truth_x"]).max() < 1e-6
    assert np.abs(off["scale"] - off["truth_x"]).max() > 5e-5


def loop_response(config: Any, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loop gain (both feedbacks open at the amplifier) and response from reference to encoder, by model and law."""
    machine = machines.build(config)
    plant = next(b.params for b in machine.plant_diagram.blocks if b.name == "plant")
    blocks = {b.name: b.params for b in machine.diagram.blocks}
    A, B = ldu.state_space(plant)
    s, dt = 2j * np.pi * f, machine.dt
    P = np.array([np.linalg.solve(x * np.eye(ldu.NX) - A, B[:, 0])[ldu.ENCODER] for x in s]) * plant.R_c * 0.1
    back = np.exp(-s * dt)
    hold = (1 - back) / (s * dt) * back  # one tick of output delay
    a = blocks["velocity"].a
    velocity = a * (1 - back) / dt / (1 - (1 - a) * back)
    pi = blocks["position"].gain + blocks["position"].integral / (1 - back)
    L = P * hold * (pi + blocks["position"].velocity_gain * velocity)
    return L, P * hold * pi / (1 + L)


def test_loop_has_the_bandwidth_and_gain_margin_of_the_thesis():
    """12.7: approximately 8 Hz, and a gain margin of only 2 dB, at the first resonance."""
    f = np.geomspace(1.0, 1000.0, 6000)
    L, T = loop_response(fused.config("ldu", "print_steps"), f)
    bandwidth = f[np.flatnonzero(np.abs(T) < np.sqrt(0.5))[0]]
    assert bandwidth == pytest.approx(8.0, rel=0.1)
    turns = [i for i in range(len(f) - 1) if L[i].real < 0 and L[i].imag * L[i + 1].imag < 0 and f[i] > 20]
    worst = max(turns, key=lambda i: abs(L[i]))
    assert 100 < f[worst] < 120
    assert -20 * np.log10(abs(L[worst])) == pytest.approx(2.0, abs=0.3)


def test_simulated_step_has_the_bandwidth_of_the_model():
    """A step without shaping and friction, against the step response of the model."""
    config = fused.config(
        "ldu", "print_steps", law__shaper__bandwidth=None, plant__parameters__F_c=0.0, law__friction__F_c=0.0
    )
    rows = fused.run(config, 1.0).between(0.5, 0.9)
    got = rows["position"] / STEP
    f = np.arange(1, 4000) * 0.5  # series of a square wave of 2 s
    odd = f[::2]
    _, T = loop_response(config, odd)
    t = rows["t"] - rows["t"][0]
    wanted = 0.5 + (2 / np.pi) * np.imag(np.exp(2j * np.pi * np.outer(t[::20], odd)) @ (T / (2 * odd)))
    np.testing.assert_allclose(got[::20], wanted, atol=0.03)
