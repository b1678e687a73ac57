"""Fits of recordings whose parameters are known, and the bounded step against one of scipy's own."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from rtctl.diagnose.fit import Fit, bounded_step, fit, jacobian, parallel, trust
from rtctl.diagnose.model import free_parameters, owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.space import SIZE, Coordinate, Hypothesis, Space

TRUE = {"M": 100.0, "F_v": 180.0, "F_c": 22.0}
VISCOUS = Hypothesis("friction.viscous", "carriage", (Coordinate("B", SIZE, 20.0),))
SPRING = Hypothesis("load.spring", "carriage", (Coordinate("k", SIZE, 100.0),))


def owners(record, *hypotheses, tolerance=None, names=None):
    owner = owner_model(record.case)
    tolerance = tolerance or record.case.tolerance
    return Space(owner, names or free_parameters(record.case, owner), tolerance, hypotheses)


@pytest.fixture(scope="module")
def exact(make_axis):
    """A recording that is not cut into steps, so that its own model leaves nothing."""
    return make_axis(step=0.0, **TRUE)


@pytest.fixture(scope="module")
def fitted(plain):
    problem = Problem(plain.sim)
    return problem, fit(problem, owners(plain.record))


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
def test_the_bounded_step_is_the_best_of_all_within_the_bounds(problem):
    J, r, x, low, high = problem
    size = np.linalg.norm(J, axis=0)
    assume(np.linalg.cond(J / size) < 1e3)
    dx = bounded_step(J.T @ J, J.T @ r, x, low, high, 0.0)
    assert (dx >= low - x).all()
    assert (dx <= high - x).all()

    def cost(dx):
        return 0.5 * float(np.sum((r + J @ dx) ** 2))

    best = lsq_linear(J, -r, (low - x, np.maximum(high - x, low - x + 1e-12)), method="bvls").x
    assert cost(dx) <= cost(best) * (1 + 1e-6) + 1e-9 * (1 + cost(0 * dx))  # it is regularised by 1e-10
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


def test_a_direction_that_nothing_shows_stays_where_it_is():
    H = np.diag([4.0, 0.0])
    dx = bounded_step(H, np.array([-4.0, 0.0]), np.zeros(2), np.full(2, -np.inf), np.full(2, np.inf), 0.0)
    np.testing.assert_allclose(dx, [1.0, 0.0], atol=1e-9)


def test_parameters_of_a_record_without_noise_come_back(exact):
    problem = Problem(exact.sim)
    free = owners(exact.record, tolerance=lambda name: 0.3)
    found = fit(problem, free, rounds=30, enough=1e-6)
    for name, value in TRUE.items():
        ratio = found.model.base["K"] * value / (35.0 * found.model.base[name])  # of force to mass: K moves too
        assert ratio == pytest.approx(1.0, abs=1e-3), name
    assert found.rms < 1e-2


def test_parameters_of_a_record_in_steps_come_back_too(fitted):
    problem, found = fitted
    for name, tolerance in (("M", 3e-3), ("F_v", 0.02), ("F_c", 0.02)):
        ratio = found.model.base["K"] * TRUE[name] / (35.0 * found.model.base[name])
        assert ratio == pytest.approx(1.0, abs=tolerance), name
    assert found.rms < problem.floor


def test_an_unknown_axis_is_found_from_far(exact):
    """Of which only the force is known, and the mass to a factor of three."""
    start = owner_model(exact.record.case).change(M=35.0, F_v=400.0, F_c=8.0)
    space = Space(start, ("M", "F_v", "F_c"), lambda name: np.inf)
    found = fit(Problem(exact.sim), space, rounds=40, enough=1e-6)
    for name, value in TRUE.items():
        assert found.model.base[name] == pytest.approx(value, rel=2e-3), name


def test_it_stays_within_the_bounds_and_says_where_it_ended_at_one(exact):
    tight = owners(exact.record, tolerance=lambda name: 0.02, names=("M", "F_v", "F_c"))
    found = fit(Problem(exact.sim), tight)
    low, high = tight.bounds()
    assert (found.x >= low).all()
    assert (found.x <= high).all()
    assert "M" in found.bound()  # is 5 % off
    wide = fit(Problem(exact.sim), owners(exact.record, tolerance=lambda name: 0.5, names=("M", "F_v", "F_c")))
    assert wide.bound() == []


def test_a_start_outside_the_bounds_is_brought_inside(exact):
    tight = owners(exact.record, tolerance=lambda name: 0.1)
    found = fit(Problem(exact.sim), tight, np.full(4, 3.0), rounds=1)
    assert (found.x <= tight.bounds()[1]).all()


def test_a_kept_jacobian_leads_where_fresh_ones_do(exact):
    problem, space = Problem(exact.sim), owners(exact.record, SPRING)
    kept = fit(problem, space, enough=1e-5)
    x = space.start()
    for _ in range(8):  # every round a fresh one
        x = fit(problem, space, x, rounds=1, J=jacobian(problem, space, x)).x
    fresh = fit(problem, space, x, rounds=3, enough=1e-5)
    assert kept.cost == pytest.approx(fresh.cost, rel=0.02, abs=1e-3)
    np.testing.assert_allclose(kept.x, fresh.x, atol=2e-3)


def test_columns_of_the_jacobian_are_slopes_of_the_residual(fitted):
    problem, found = fitted
    space = found.space.add(VISCOUS)
    x = np.append(found.x, 0.0)
    J = jacobian(problem, space, x)
    two = jacobian(problem, space, x, [0, 4])
    np.testing.assert_array_equal(two, J[:, [0, 4]])
    moved = x.copy()
    moved[4] -= 0.05
    change = problem.residual(space.model(moved)) - found.r
    assert np.corrcoef(change, -J[:, 4])[0, 1] > 0.99
    assert np.linalg.norm(change) == pytest.approx(0.05 * np.linalg.norm(J[:, 4]), rel=0.1)


def test_at_the_upper_bound_the_step_goes_down(exact):
    problem = Problem(exact.sim)
    space = owners(exact.record, tolerance=lambda name: 0.1)
    x = space.bounds()[1]
    asked = []
    wrapped = Problem(exact.sim)
    wrapped.residual = lambda model, coarse: asked.append(model.base["M"]) or problem.residual(model)  # type: ignore[method-assign]
    jacobian(wrapped, space, x, [0])
    assert asked[1] < asked[0] == pytest.approx(95.0 * 1.1)


def test_a_column_that_hardly_matters_is_kept(exact):
    problem, space = Problem(exact.sim), owners(exact.record, VISCOUS)
    x = space.start()
    old = jacobian(problem, space, x)
    idle = old.copy()
    idle[:, 1] = 1e-6  # as of a parameter that nothing shows
    again = jacobian(problem, space, x, old=idle)
    np.testing.assert_array_equal(again[:, 1], 1e-6)
    np.testing.assert_array_equal(again[:, [0, 2, 3, 4]], old[:, [0, 2, 3, 4]])


def test_a_fit_that_is_given_up_ends_there(exact):
    seen = []
    fit(Problem(exact.sim), owners(exact.record), give_up=lambda cost: seen.append(cost) or True)
    assert len(seen) == 1


def test_cost_never_rises(exact):
    problem, space = Problem(exact.sim), owners(exact.record)
    start = problem.residual(space.model(space.start()))
    costs = [fit(problem, space, rounds=k).cost for k in (1, 2, 4)]
    assert 0.5 * float(start @ start) >= costs[0] >= costs[1] >= costs[2]


def test_every_further_number_of_a_term_costs_something(fitted):
    _, found = fitted
    merits = [
        Fit(found.space.add(*[VISCOUS] * k), np.append(found.x, np.zeros(k)), found.r, found.J, found.cost).merit
        for k in range(3)
    ]
    assert merits[0] == found.cost
    assert merits[0] < merits[1] < merits[2] < 1.5 * merits[0]


def test_errors_of_a_model_that_lacks_something_weigh_less_against_the_owner():
    assert trust(np.full(10, 0.5)) == trust(np.ones(10))
    assert trust(np.full(10, 3.0)) == pytest.approx(9.0 * trust(np.ones(10)))


def test_jobs_side_by_side_come_back_in_their_order():
    assert [int(a[0]) for a in parallel([lambda i=i: np.array([i]) for i in range(7)])] == list(range(7))
    assert parallel([]) == []
