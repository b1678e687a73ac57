"""Cogging does no work over a tooth; encoder errors change only the reading."""

import math

import numpy as np
import pytest
import stand
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.plants.physics import ripple

H = 1e-3
TURN = 2 * math.pi
phases = st.floats(-4, 4)


def cogging(**values: float) -> ripple.CoggingParams:
    return ripple.build_cogging(ripple.CoggingSettings(node="motor1", **{"A": 0.0, **values}), H)


def encoder(**values: float) -> ripple.EncoderParams:
    return ripple.build_encoder(ripple.EncoderSettings(node="encoder", **{"A": 0.0, **values}), H)


@settings(deadline=None)
@given(phases, phases, phases, st.floats(-1, 1), st.floats(-1, 1), st.sampled_from([1.0, 5.0, 12.0]))
def test_cogging_does_no_work_over_a_turn(phi, phi2, phi3, A2, A3, teeth):
    p = cogging(A=1.0, phi=phi, A2=A2, phi2=phi2, A3=A3, phi3=phi3, per_turn=teeth)
    q = np.linspace(0, TURN, 1001)[:-1]
    torque = np.array([ripple.cogging(p, x) for x in q])
    assert abs(torque.mean()) < 1e-12
    assert np.abs(torque).max() <= 1 + abs(A2) + abs(A3)
    assert ripple.cogging(p, 0.3 + TURN / teeth) == pytest.approx(ripple.cogging(p, 0.3), abs=1e-12)


def test_cogging_has_its_amplitude_phase_and_pitch():
    p = cogging(A=2.0, per_turn=7.0)
    assert ripple.cogging(p, 0.0) == 0.0
    assert ripple.cogging(p, TURN / 28) == pytest.approx(2.0)
    p = cogging(A=2.0, phi=math.pi / 2, turn=0.03)  # a linear motor of 30 mm pitch
    assert ripple.cogging(p, 0.015) == pytest.approx(-2.0)


def test_frictionless_axis_with_cogging_conserves_energy():
    """Oscillation in a cogging minimum: the sum of kinetic and potential energy is constant."""
    A, pitch, M = 50.0, 0.03, 95.1
    term = stand.make("ripple.cogging", "axis", A=A, phi=math.pi, turn=pitch)
    x = stand.run("axis", [term], np.zeros((20000, 1)), x={1: 0.05}, F_v=0.0, F_c=0.0).x
    energy = 0.5 * M * x[:, 1] ** 2 - A * pitch / TURN * np.cos(TURN / pitch * x[:, 0])
    swing = 0.5 * M * 0.05**2
    assert np.ptp(x[:, 0]) > 0.005
    assert np.abs(energy - energy[0]).max() < 0.01 * swing
    assert abs(energy[-2000:].mean() - energy[:2000].mean()) < 2e-3 * swing


@settings(deadline=None)
@given(phases, phases, phases, st.floats(-100, 100), st.sampled_from([1.0, 2.0, 2500.0]))
def test_encoder_error_is_periodic_and_starts_at_zero(phi, phi2, phi3, y, order):
    p = encoder(A=1e-2, phi=phi, A2=1e-3, phi2=phi2, A3=-1e-3, phi3=phi3, order=order)
    assert ripple.encoder(p, 0.0) == 0.0
    error = ripple.encoder(p, y) - y
    assert abs(error) <= 2 * 1.2e-2
    assert ripple.encoder(p, y + TURN) - (y + TURN) == pytest.approx(error, abs=1e-9)
    assert ripple.encoder(encoder(phi=phi), y) == y


def test_encoder_eccentricity_of_the_thesis_is_a_sine():
    """5 um on a graduation of 19 mm (11.5)."""
    p = encoder(A=5e-6 / 19e-3, phi=math.pi / 2)
    for theta in np.linspace(0, TURN, 50):
        exact = math.atan(5e-6 * math.cos(theta) / 19e-3) - math.atan(5e-6 / 19e-3)
        assert ripple.encoder(p, theta) - theta == pytest.approx(exact, abs=2e-11)


@pytest.mark.parametrize(("kind", "channel"), [("ivu", 0), ("ldu", 0), ("axis", 0)])
def test_encoder_error_changes_only_its_channel(kind, channel):
    u = stand.excitation(kind, 200)
    one, two = stand.run(kind, [], u), stand.run(kind, [stand.make("ripple.encoder", kind, A=1e-3)], u)
    assert np.array_equal(one.x, two.x)
    changed = np.abs(two.y - one.y).max(axis=0) > 0
    assert changed[channel] and changed.sum() == 1


def test_encoder_error_of_a_speed_sensor_is_the_rate_of_the_position_error():
    p = ripple.build_encoder(
        ripple.EncoderSettings(node="tacho", A=0.01, phi=0.3, order=2.0, A2=0.004, phi2=1.0, A3=0.002, phi3=2.0), 1e-3
    )
    v, dt = 3.0, 1e-6
    for q in np.linspace(-4.0, 4.0, 9):
        rate = (ripple.shown(p, q + 0.5 * v * dt, 0.0, 0) - ripple.shown(p, q - 0.5 * v * dt, 0.0, 0)) / dt
        assert ripple.shown(p, v, q, 1) == pytest.approx(rate, rel=1e-6)
