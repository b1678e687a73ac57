"""Coupled mechanics: Lagrange equations, motion against scipy's integrator, energy, static friction."""

from typing import Any

import numpy as np
import pytest
from coupled_machines import NAMES, data_of, free, functions, params
from scipy.integrate import solve_ivp

from rtctl.plants.graph.coupled import felt, machine_params, pulled
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.layout import layout
from rtctl.plants.graph.linearised import linearised
from rtctl.plants.graph.played import played

G_N = 9.80665  # m/s^2


def rod(m: float, J: float, d: float) -> list[tuple[float, float]]:
    """Two point masses and their distances from the joint, with the mass, centre and inertia of a slender rod."""
    half = np.sqrt(J / m)
    return [(0.5 * m, d - half), (0.5 * m, d + half)]


def furuta_mass(q: np.ndarray, way: float, r: float) -> np.ndarray:
    """Position (3,) of a mass at distance `way` along the pendulum, by rotation of vectors."""
    c, s = np.cos(q[0]), np.sin(q[0])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return turn @ (np.array([r, 0.0, 0.0]) + way * np.array([0.0, np.sin(q[1]), -np.cos(q[1])]))


def cart_mass(q: np.ndarray, way: float, r: float) -> np.ndarray:
    """Position (3,) of a mass at distance `way` along the pole."""
    return np.array([q[0] + way * np.sin(q[1]), 0.0, -way * np.cos(q[1])])


def lagrange(place: Any, masses: list[tuple[float, float]], own: float, r: float) -> Any:
    """M and h of point masses by finite differences of positions: T = sum m |dx/dt|^2 / 2, V = sum m g z."""

    def energy(q: np.ndarray, v: np.ndarray) -> float:
        e = 1e-4
        speeds = [(place(q + e * v, way, r) - place(q - e * v, way, r)) / (2 * e) for _, way in masses]
        return 0.5 * own * v[0] ** 2 + sum(0.5 * m * (w @ w) for (m, _), w in zip(masses, speeds, strict=True))

    def matrix(q: np.ndarray) -> np.ndarray:
        one, two = np.eye(2)
        cross = energy(q, one + two) - energy(q, one) - energy(q, two)
        return np.array([[2 * energy(q, one), cross], [cross, 2 * energy(q, two)]])

    def of(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        e = 1e-4
        slopes = [(matrix(q + e * d) - matrix(q - e * d)) / (2 * e) for d in np.eye(2)]
        heights = [sum(m * (place(q + e * d, way, r) - place(q - e * d, way, r))[2] for m, way in masses) / (2 * e)
                   for d in np.eye(2)]  # fmt: skip
        rate = sum(s * x for s, x in zip(slopes, v, strict=True))
        h = rate @ v - 0.5 * np.array([v @ s @ v for s in slopes]) + G_N * np.array(heights)
        return matrix(q), h

    return of


@pytest.mark.parametrize(("name", "place"), [("furuta", furuta_mass), ("cart-pole", cart_mass)])
def test_equations_of_motion_match_lagrange(name, place):
    data = data_of(name)
    first, second = data["bodies"].values()
    number = data["mechanics"]["parameters"]
    own = first.get("inertia") or first["mass"]
    other = lagrange(place, rod(number["m"], second["inertia"], number["d"]), own, number.get("r", 0.0))
    ours = functions(params(Description.model_validate(data), 1e-3))
    rng = np.random.default_rng(1)
    for q, v in rng.uniform(-3, 3, (10, 2, 2)):
        for mine, theirs in zip(ours(q, v), other(q, v), strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-5, atol=1e-6 * np.abs(theirs).max())


@pytest.mark.parametrize("name", NAMES)
def test_free_swing_matches_scipy_and_conserves_energy(name):
    machine = free(name, 2.5)
    p, n = params(machine, 1e-3), 10_000
    q = played(p, np.zeros((n, 1)), 1) + np.array([0.0, 2.5])
    of = functions(p)

    def rates(t: float, z: np.ndarray) -> np.ndarray:
        M, h = of(z[:2], z[2:])
        return np.concatenate([z[2:], np.linalg.solve(M, -h)])

    length = 2000
    true = solve_ivp(rates, (0.0, 2.0), [0.0, 2.5, 0.0, 0.0], rtol=1e-9, atol=1e-10, t_eval=np.arange(length) * 1e-3)
    np.testing.assert_allclose(q[:length], true.y[:2].T, atol=2e-6)
    v = np.gradient(q, 1e-3, axis=0)
    number = machine.mechanics.parameters
    M = [of(x, x)[0] for x in q]
    weight = number["m"] * G_N * number["d"]
    E = np.array([0.5 * w @ m @ w for w, m in zip(v, M, strict=True)]) - weight * np.cos(q[:, 1])
    top = (E[5:-5] + weight).max()  # energy above the hanging position
    late, early = np.mean(E[-1000:-5]), np.mean(E[5:1000])
    assert abs(late - early) < 1e-4 * top


@pytest.mark.parametrize("name", NAMES)
def test_halving_the_substep_changes_less_than_a_tenth_of_a_count(name):
    machine = Description.model_validate(data_of(name))
    t = np.arange(4000) * 1e-3
    u = (3.0 * np.sin(2 * np.pi * 0.9 * t) + 2.0 * np.sign(np.sin(2 * np.pi * 0.4 * t)))[:, None]
    scales = np.array([sensor.scale for sensor in machine.sensors.values()])
    one, two = (played(params(machine, 1e-3 / k), u, k) * scales for k in (1, 2))
    assert np.ptp(one, axis=0).min() > 200
    assert np.abs(one - two).max() < 0.1


def test_sticking_body_stays_exactly_at_rest_while_the_other_body_swings():
    data = data_of("furuta")
    data["bodies"]["arm"]["dry"] = 0.05
    data["mechanics"]["at"] = {"pendulum": 1.0}
    q = played(params(Description.model_validate(data), 1e-3), np.zeros((2000, 1)), 1)
    assert not q[:, 0].any() and np.ptp(q[:, 1]) > 1.0


def test_pendulum_at_a_sticking_arm_swings_like_a_simple_pendulum():
    """J q'' = -m g d sin q, with the arm at rest."""
    data = data_of("furuta")
    data["bodies"] = {"arm": {"inertia": 1.2e-4, "dry": 0.05}, "pendulum": {"inertia": 3.33e-5}}
    data["mechanics"]["at"] = {"pendulum": 1.0}
    q = played(params(Description.model_validate(data), 1e-3), np.zeros((2000, 1)), 1)[:, 1] + 1.0
    number = data["mechanics"]["parameters"]
    J, weight = 3.33e-5 + number["m"] * number["d"] ** 2, number["m"] * G_N * number["d"]
    true = solve_ivp(
        lambda t, z: [z[1], -weight / J * np.sin(z[0])], (0, 2), [1.0, 0.0], rtol=1e-9, atol=1e-10,
        t_eval=np.arange(2000) * 1e-3,
    )  # fmt: skip
    np.testing.assert_allclose(q, true.y[0], atol=1e-4)


def test_gear_reflects_the_rotor_inertia_onto_the_arm():
    """A rotor behind a rigid gear of ratio 5 adds 25 times its inertia to the arm."""
    data = data_of("furuta")
    for body in data["bodies"].values():
        body |= {"dry": 0.0, "viscous": 0.0}
    data["drives"] = {"motor": {"body": "arm", "column": "u", "gain": 1e-3}}
    data["mechanics"]["at"] = {"pendulum": 1.0}
    heavier = {**data, "bodies": {**data["bodies"], "arm": {"inertia": 1.2e-4 + 25 * 4e-6}}}
    geared = {**data, "bodies": {"rotor": {"inertia": 4e-6}, **data["bodies"]},
              "joints": {"gear": {"from": "rotor", "to": "arm", "ratio": 0.2}},
              "drives": {"motor": {"body": "rotor", "column": "u", "gain": 2e-4}}}  # fmt: skip
    u = np.ones((1500, 1))
    one, two = (played(params(Description.model_validate(d), 1e-3), u, 1) for d in (heavier, geared))
    np.testing.assert_allclose(one, two, atol=1e-8)


def test_linear_model_has_the_eigenvalues_of_hanging_and_upright_pendulum():
    """w^2 = m g d / (J - (m r d)^2 / (J0 + m r^2)); the hanging pendulum oscillates, the upright pendulum falls."""
    machine = free("furuta", 0.0)
    number, J0 = machine.mechanics.parameters, machine.bodies["arm"].inertia
    J = machine.bodies["pendulum"].inertia + number["m"] * number["d"] ** 2
    weight, couple = number["m"] * G_N * number["d"], number["m"] * number["r"] * number["d"]
    w = np.sqrt(weight / (J - couple**2 / (J0 + number["m"] * number["r"] ** 2)))
    A, _ = linearised(params(machine, 1e-3))
    assert np.abs(np.linalg.eigvals(A).imag).max() == pytest.approx(w, rel=1e-6)
    A, _ = linearised(params(free("furuta", np.pi), 1e-3))
    assert np.linalg.eigvals(A).real.max() == pytest.approx(w, rel=1e-6)


def test_motion_of_the_furuta_pendulum_depends_on_the_pendulum_angle():
    machine = free("furuta", 0.0)
    assert felt(layout(machine), dict(machine.paths())) == ["pendulum"]
    assert pulled(layout(machine), dict(machine.paths())) == ["pendulum"]


def test_mass_matrix_that_is_not_positive_definite_is_refused():
    machine = free("furuta", 0.0)
    values = {**dict(machine.paths()), "bodies.pendulum.inertia": -1.0}
    with pytest.raises(ValueError, match="M of Furuta is not positive definite"):
        machine_params(layout(machine), values, 1e-3)
