"""Steps of a fit: the bounded step against scipy, and parallel jobs."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from rtctl.diagnose.likelihood.solver import bounded_step, parallel, trust


@st.composite
def problems(draw):
    n = draw(st.integers(1, 6))
    rows = draw(st.integers(n, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    J = rng.standard_normal((rows, n)) * 10.0 ** rng.uniform(-2, 2, n)
    r = 10.0 * rng.standard_normal(rows)
    x = rng.uniform(-1, 1, n)
    low, high = x - rng.exponential(0.5, n), x + rng.exponential(0.5, n)
    for i in range(n):
        if rng.random() < 0.2:
            low[i] = -np.inf
        if rng.random() < 0.2:
            high[i] = np.inf
        if rng.random() < 0.1:
            low[i] = x[i]
    return J, r, x, low, high


@settings(deadline=None, max_examples=60)
@given(problems())
def test_bounded_step_matches_scipy_lsq_linear(problem):
    J, r, x, low, high = problem
    size = np.linalg.norm(J, axis=0)
    assume(np.linalg.cond(J / size) < 1e3)
    dx = bounded_step(J.T @ J, J.T @ r, x, low, high, 0.0)
    assert (dx >= low - x).all()
    assert (dx <= high - x).all()

    def cost(dx):
        return 0.5 * float(np.sum((r + J @ dx) ** 2))

    best = lsq_linear(J, -r, (low - x, np.maximum(high - x, low - x + 1e-12)), method="bvls").x
    assert cost(dx) <= cost(best) * (1 + 1e-6) + 1e-9 * (1 + cost(0 * dx))  # regularisation of 1e-10
    np.testing.assert_allclose(size * dx, size * best, rtol=1e-4, atol=1e-4 * np.linalg.norm(r))


@settings(deadline=None, max_examples=30)
@given(problems(), st.floats(1e-4, 1e3))
def test_damping_shortens_the_step(problem, damping):
    J, r, x, *_ = problem
    free = np.full(len(x), np.inf)
    H, g = J.T @ J, J.T @ r
    assume(np.linalg.cond(H) < 1e8)
    d = np.sqrt(np.diag(H))
    steps = [np.linalg.norm(d * bounded_step(H, g, x, -free, free, k)) for k in (0.0, damping, 10 * damping)]
    assert steps[0] >= steps[1] * (1 - 1e-6)
    assert steps[1] >= steps[2] * (1 - 1e-6)


def test_unobservable_direction_is_not_moved():
    H = np.diag([4.0, 0.0])
    dx = bounded_step(H, np.array([-4.0, 0.0]), np.zeros(2), np.full(2, -np.inf), np.full(2, np.inf), 0.0)
    np.testing.assert_allclose(dx, [1.0, 0.0], atol=1e-9)


def test_prior_weight_grows_with_the_level_of_unexplained_residuals():
    assert trust(np.full(10, 0.5)) == trust(np.ones(10))
    assert trust(np.full(10, 3.0)) == pytest.approx(9.0 * trust(np.ones(10)))


def test_parallel_jobs_return_in_order():
    assert [int(a[0]) for a in parallel([lambda i=i: np.array([i]) for i in range(7)])] == list(range(7))
    assert parallel([]) == []
