"""Propagation of a linear machine with dry friction: scipy, closed forms and invariants."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from rtctl.idiom import tick
from rtctl.plants import linear

GAIN, LIMIT = 0.01, 2.0  # speed per unit force over a substep, friction
STILL = 1e-18  # speed: rounding error of the holding force
speeds = st.floats(-1.0, 1.0).map(lambda v: 0.0 if abs(v) < 1e-9 else v)


def machine(A: np.ndarray, G: np.ndarray, h: float, nq: int, dry: list[float]) -> Any:
    """Machine record, discretised."""
    s = np.zeros(1, linear.MACHINE).view(np.recarray)[0]
    nx, ng = G.shape
    linear.size(s, nq, nx, ng - nq, 1, 1)
    s.h, s.A[:nx, :nx], s.G[:nx, :ng] = h, A, G
    linear.discretise_machine(s)
    s.dry_base[:nq] = dry
    return s


def mass(h: float, M: float = 1.0, dry: float = 0.0, k: float = 0.0, d: float = 0.0) -> Any:
    """One mass with a force at input 0; friction is the only node force."""
    A = np.array([[0.0, 1.0], [-k / M, -d / M]])
    return machine(A, np.array([[0.0, 0.0], [1.0 / M, 1.0 / M]]), h, 1, [dry])


@tick
def run(m, n):
    """`n` substeps."""
    for _ in range(n):
        linear.midpoint(m)
        linear.advance(m)


def van_loan(A: np.ndarray, G: np.ndarray, h: float) -> tuple[np.ndarray, np.ndarray]:
    n = len(A) + G.shape[1]
    M = np.zeros((n, n))
    M[: len(A)] = np.hstack([A, G])
    P = expm(M * h)
    return P[: len(A), : len(A)], P[: len(A), len(A) :]


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(1.0, 5.0), st.floats(-5.0, -2.0))
def test_discretise_is_the_matrix_exponential_of_stiff_chains(seed, stiffness, step):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    K = np.zeros((n, n))
    for i in range(n - 1):
        K[i : i + 2, i : i + 2] += 10 ** rng.uniform(0, stiffness) * np.array([[1, -1], [-1, 1]])
    inverse = np.diag(10 ** rng.uniform(-1, 1, n))
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ K, -1e-3 * inverse @ K]])
    G = np.vstack([np.zeros((n, n)), inverse])
    Phi_T, Gamma_T = linear.discretise(A, G, 10**step)
    Phi, Gamma = van_loan(A, G, 10**step)
    position = 10.0 ** np.r_[np.zeros(n), np.full(n, 2)]  # speeds are large where positions are small
    assert np.abs((Phi_T.T - Phi) * position / position[:, None]).max() < 1e-10
    np.testing.assert_allclose(Gamma_T.T, Gamma, rtol=0, atol=1e-10 * np.abs(Gamma).max())


def test_discretisation_of_zero_matrices_and_of_a_free_mass_is_exact():
    Phi_T, Gamma_T = linear.discretise(np.zeros((2, 2)), np.zeros((2, 1)), 0.1)
    assert np.array_equal(Phi_T, np.eye(2)) and not Gamma_T.any()
    Phi_T, Gamma_T = linear.discretise(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.1)
    np.testing.assert_allclose(Phi_T.T, [[1.0, 0.1], [0.0, 1.0]], rtol=1e-15)
    np.testing.assert_allclose(Gamma_T[0], [0.005, 0.1], rtol=1e-14)


def test_rigid_body_motion_does_not_drift_in_a_million_steps():
    """Two masses of ratio 1e4 on a stiff spring: a rest position and a constant speed persist."""
    k, d, m1, m2 = 1e4, 1e-2, 1.0, 1e-4
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-k / m1, k / m1, -d / m1, d / m1], [k / m2, -k / m2, d / m2, -d / m2]])
    G = np.vstack([np.zeros((2, 2)), np.diag([1 / m1, 1 / m2])])
    m = machine(A, G, 5e-4, 2, [0.0, 0.0])
    m.x[:2] = 1.0
    run(m, 1_000_000)
    np.testing.assert_allclose(m.x[:2], 1.0, rtol=0, atol=1e-6)  # rounding; a count is 6e-4 rad
    assert np.abs(m.x[2:4]).max() < 1e-8
    m.x[:4] = [0.0, 0.0, 1.0, 1.0]
    run(m, 1_000_000)
    np.testing.assert_allclose(m.x[:4], [500.0, 500.0, 1.0, 1.0], rtol=1e-6)


def test_midpoint_is_exact_for_constant_acceleration():
    h = 0.1
    m = mass(h)
    m.u[0] = 3.0
    m.x[1] = 2.0
    run(m, 1)
    linear.midpoint(m)
    t = 1.5 * h
    np.testing.assert_allclose([m.qm[0], m.vm[0]], [2 * t + 1.5 * t**2, 2 + 3 * t], rtol=1e-14)


def test_dry_friction_holds_the_mass_exactly_at_rest_up_to_its_limit():
    m = mass(1e-3, dry=2.0)
    m.u[0] = 2.0
    run(m, 1000)
    assert m.x[0] == pytest.approx(0.0, abs=1e-18)
    assert m.x[1] == 0.0
    assert m.r[0] == pytest.approx(-2.0)
    m.u[0] = 2.01
    run(m, 1000)
    assert m.x[1] == pytest.approx(0.01)
    assert m.x[0] == pytest.approx(0.005)


@settings(deadline=None)
@given(st.floats(-0.999, 0.999))
def test_dry_friction_at_rest_balances_the_applied_force(share):
    push = share * GAIN * LIMIT
    assert push + GAIN * linear.dry_friction(0.0, push, GAIN, LIMIT) == pytest.approx(0.0, abs=1e-15)


@settings(deadline=None)
@given(speeds.filter(bool), st.floats(0.0, 10.0))
def test_sliding_dry_friction_is_its_limit_against_the_motion(v, push):
    s = math.copysign(1.0, v)
    assert linear.dry_friction(v, v + s * (push + GAIN * LIMIT), GAIN, LIMIT) == -s * LIMIT


@settings(deadline=None, max_examples=500)
@given(speeds, speeds, st.floats(1e-6, 1.0), st.floats(1e-6, 10.0))
def test_dry_friction_is_bounded_and_dissipative(v, v_free, gain, limit):
    """Over a substep the speed never exceeds the speed of the frictionless mass."""
    r = linear.dry_friction(v, v_free, gain, limit)
    assert abs(r) <= limit * (1 + 1e-9)
    after = v_free + gain * r
    assert abs(after) <= max(abs(v), abs(v_free)) + 1e-12
    if v == 0.0 or v * v_free >= 0.0:  # the direction is unchanged: the work of friction is negative
        assert r * (v + after) <= 1e-12 * limit


def test_dry_friction_is_odd():
    rng = np.random.default_rng(1)
    for v, v_free in rng.uniform(-1, 1, (200, 2)) * 0.05:
        right = linear.dry_friction(v, v_free, GAIN, LIMIT)
        assert linear.dry_friction(-v, -v_free, GAIN, LIMIT) == -right


def coast(h: float, F: float, v: float, t: float, dry: float) -> np.ndarray:
    m = mass(h, dry=dry)
    m.u[0], m.x[1] = F, v
    run(m, round(t / h))
    return np.array(m.x[:2])


def test_reversal_within_a_substep_is_second_order_accurate():
    """Motion against a force above the friction: deceleration F + F_c, reversal, acceleration F - F_c."""
    F, v, dry, t = -3.0, 1.0, 1.0, 1.0
    turn = v / (3.0 + dry)
    exact = np.array([v * turn / 2 - 0.5 * 2.0 * (t - turn) ** 2, -2.0 * (t - turn)])
    steps, throws = (1e-2, 5e-3, 2.5e-3, 1.25e-3), v + np.linspace(0, 0.05, 20)
    errors = np.array(
        [max(np.abs(coast(h, F, w, t, dry) - _exact_reversal(F, w, t, dry)).max() for w in throws) for h in steps]
    )
    np.testing.assert_allclose(_exact_reversal(F, v, t, dry), exact)
    assert errors[0] < 2e-4
    assert np.all(errors[:-1] / errors[1:] > 3.0), errors


def _exact_reversal(F: float, v: float, t: float, dry: float) -> np.ndarray:
    turn = v / (dry - F)
    back = F + dry
    return np.array([v * turn / 2 + 0.5 * back * (t - turn) ** 2, back * (t - turn)])


def test_stopping_distance_under_dry_friction():
    for h in (1e-2, 1e-3):
        x, v = coast(h, 0.0, 1.0, 2.0, 1.0)
        assert v == 0.0
        assert x == pytest.approx(0.5, abs=0.51 * h**2 + 1e-9)


def test_coulomb_damping_reduces_every_half_swing_by_a_constant():
    """Coulomb damping: every half swing is shorter by 2 F_c / k."""
    k, dry, h = 100.0, 1.0, 1e-4
    m = mass(h, k=k, dry=dry)
    m.x[0] = 0.105
    peaks = []
    for _ in range(12):
        run(m, round(math.pi / 10 / h) + 1)
        peaks.append(abs(m.x[0]))
    want = np.maximum(0.105 - 0.02 * np.arange(1, 13), 0)
    np.testing.assert_allclose(peaks[:5], want[:5], atol=1e-5)
    assert abs(m.x[1]) < STILL and abs(m.x[0]) <= dry / k


@settings(deadline=None, max_examples=20)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4), st.floats(0.01, 1.0), st.floats(0.01, 1.0))
def test_energy_of_coupled_nodes_with_friction_never_increases(x, dry1, dry2):
    """Except for a stop within a substep: the node stops at the end of the substep, h v / 2 too far.

    For v below twice gain times limit the error is at most (limit h)^2 / M per node, second order in h.
    """
    m = pair(dry1, dry2)
    allowed = (dry1**2 + dry2**2) * m.h**2
    m.x[:4] = [0.01 * x[0], 0.01 * x[1], x[2], x[3]]
    last = energy(m)
    for _ in range(50):
        run(m, 10)
        now = energy(m)
        assert now <= last * (1 + 1e-9) + allowed
        last = now
    assert last <= energy_at(x) + 2 * allowed


def energy_at(x: list[float]) -> float:
    return 0.5 * (x[2] ** 2 + x[3] ** 2 + 0.1 * (x[0] - x[1]) ** 2)


def pair(dry1: float, dry2: float, h: float = 5e-4) -> Any:
    """Two unit masses on a spring of 1 kN/m."""
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-1e3, 1e3, -1, 1], [1e3, -1e3, 1, -1]], float)
    G = np.vstack([np.zeros((2, 4)), np.hstack([np.eye(2), np.eye(2)])])
    return machine(A, G, h, 2, [dry1, dry2])


def energy(m: Any) -> float:
    return 0.5 * float(m.x[2] ** 2 + m.x[3] ** 2 + 1e3 * (m.x[0] - m.x[1]) ** 2)


def test_gauss_seidel_solution_holds_both_ends_of_a_loaded_spring():
    """Force of 1.5 N: friction of the first node takes 1 N, the spring transmits 0.5 N to the second node."""
    m = pair(1.0, 1.0)
    m.u[0] = 1.5
    run(m, 40_000)
    assert np.abs(m.x[2:4]).max() < STILL
    assert 0 < m.r[0] * -1 <= 1.0 and 0 <= -m.r[1] <= 1.0
    assert 1.5 + m.r.sum() == pytest.approx(0.0, abs=1e-6)
    m.u[0] = 2.5
    run(m, 40_000)
    assert m.x[2] == pytest.approx(m.x[3], rel=1e-3)
    assert m.x[2:4].mean() == pytest.approx(0.5 * 0.5 * 20, rel=0.02)  # (2.5 - 2) N on 2 kg for 20 s


def test_advance_and_discretise_allocate_no_memory(allocations):
    m = pair(0.1, 0.2)
    m.u[0] = 1.0
    assert allocations(run, m, 1000) == allocations(run, m, 1)
    assert allocations(discretisations, m, 100) == allocations(discretisations, m, 1)


@tick
def discretisations(m, n):
    for _ in range(n):
        linear.discretise_machine(m)


@pytest.mark.parametrize("rate", [np.inf, np.nan, 1e200])
def test_discretisation_of_a_divergent_machine_gives_nan(rate):
    Phi_T, Gamma_T = linear.discretise(np.array([[0.0, 1.0], [-rate, 0.0]]), np.array([[0.0], [1.0]]), 1e-3)
    assert np.isnan(Phi_T).all() and np.isnan(Gamma_T).all()
