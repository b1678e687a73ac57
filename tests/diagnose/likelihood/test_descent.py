from functools import cache

import numpy as np
import pytest
from graph_cases import BELT, RUB, case_of, command, record

from rtctl.diagnose.likelihood import fits
from rtctl.diagnose.likelihood.descent import ALL, Point, derivatives, descend
from rtctl.diagnose.likelihood.fits import refit
from rtctl.diagnose.likelihood.joint import together
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.space import SIZE, Coordinate, Hypothesis

DRY = Hypothesis(RUB["term"], RUB["node"], (Coordinate("F_C", SIZE, 1.0, low=0.0),))


@cache
def problem():
    """Likelihood, unknowns and base fit of a belt axis with extra dry friction."""
    like, space = together([record(case_of(BELT), command(0.6), [RUB])])
    return like, space, refit(like, space)


class Flat:
    """Linear problem: the residual is A x - b under white noise of unit variance."""

    def __init__(self, A, b):
        self.A, self.b, self.calls = A, b, 0

    def raw(self, x, coarse=False):
        self.calls += 1
        return (self.A @ x - self.b)[:, None]

    def white(self, e):
        return e[:, 0]

    def filtered(self, columns):
        return columns[:, 0]

    def ran_away(self, e):
        return False

    def rough(self, x):
        return self.raw(x), True


class Cliff(Flat):
    """Linear problem whose model diverges where an unknown is above `up` or below `down`."""

    def __init__(self, A, b, up, down):
        super().__init__(A, b)
        self.up, self.down = up, down

    coarsely = True  # False: coarse simulations diverge

    rough = Likelihood.rough

    def raw(self, x, coarse=False):
        if coarse and not self.coarsely:
            return np.full((len(self.b), 1), 1e9)
        return np.full((len(self.b), 1), 1e9) if (x > self.up).any() or (x < self.down).any() else super().raw(x)

    def ran_away(self, e):
        return bool((np.abs(e) > 1e8).any())


class Unknowns:
    """Unknowns without a prior; the model is x."""

    nb, hypotheses = 0, (None,)

    def __init__(self, count, high=10.0):
        self.count, self.high = count, high

    def model(self, x):
        return x

    def start(self):
        return np.zeros(self.count)

    def bounds(self):
        return np.full(self.count, -10.0), np.full(self.count, self.high)

    def prior(self):
        return np.zeros(self.count)

    def steps(self):
        return np.full(self.count, 1e-2)

    def reach(self):
        return np.zeros(0)


def linear(high=10.0):
    rng = np.random.default_rng(0)
    A, truth = rng.standard_normal((50, 4)), np.array([1.0, -2.0, 0.5, 3.0])
    return Flat(A, A @ truth + 0.01 * rng.standard_normal(50)), Unknowns(4, high), truth


def test_descent_solves_a_linear_problem():
    like, space, _ = linear()
    x = np.zeros(4)
    J = derivatives(like, space, x, range(4))
    np.testing.assert_allclose(J[:, 0], like.A, rtol=1e-4, atol=1e-6)
    found = descend(like, space, Point(x, like.raw(x), J, ALL), 10, 1e-6)
    np.testing.assert_allclose(found.x, np.linalg.lstsq(like.A, like.b, rcond=None)[0], atol=1e-4)


def test_derivatives_of_no_columns_need_no_simulation():
    like, space, _ = linear()
    J = np.ones((50, 1, 4), np.float32)
    assert derivatives(like, space, np.zeros(4), [], J) is J
    assert like.calls == 0


def test_wrong_derivatives_are_corrected_during_the_descent():
    like, space, truth = linear()
    x = np.zeros(4)
    wrong = (like.A * np.array([0.5, 1.5, 1.0, 1.2]))[:, None, :].astype(np.float32)
    found = descend(like, space, Point(x, like.raw(x), wrong), 30, 1e-6)
    np.testing.assert_allclose(found.x, truth, atol=0.02)
    np.testing.assert_allclose(found.J[:, 0], like.A, atol=1e-3)
    assert (
        wrong[:, 0] == (like.A * np.array([0.5, 1.5, 1.0, 1.2])).astype(np.float32)
    ).all()  # the argument is unchanged


def test_descent_respects_the_bounds():
    like, space, _ = linear(high=2.0)
    x = np.zeros(4)
    found = descend(like, space, Point(x, like.raw(x), derivatives(like, space, x, range(4)), ALL), 10, 1e-6)
    assert found.x[3] == 2.0
    free = np.linalg.lstsq(like.A[:, :3], like.b - 2.0 * like.A[:, 3], rcond=None)[0]
    np.testing.assert_allclose(found.x[:3], free, atol=1e-3)


def test_fit_reuses_the_derivatives_of_the_base():
    like, space, base = problem()
    wider = space.add(DRY)
    start = np.append(base.x, 0.5)
    taken = []

    def counted(like, space, x, columns, *more):
        taken.append(list(columns))
        return derivatives(like, space, x, columns, *more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fits, "derivatives", counted)
        anew = refit(like, wider, start)
        further = refit(like, wider, start, base.J)
    assert taken == [list(range(len(start))), [len(start) - 1]]
    assert further.loss < anew.loss + 2.0
    assert further.x[-1] == pytest.approx(RUB["F_C"], rel=0.1)


def test_derivatives_of_a_fit_are_evaluated_at_its_solution():
    like, space, base = problem()
    f = refit(like, space.add(DRY), np.append(base.x, 0.5), base.J)
    there = derivatives(f.like, f.space, f.x, range(len(f.x)))
    size = np.linalg.norm(there, axis=(0, 1))
    apart = np.linalg.norm(f.J - there, axis=(0, 1))
    assert (apart < 0.05 * size + 1e-3 * size.max()).all()


@pytest.mark.parametrize(("up", "down", "known"), [(1e-9, -1.0, True), (1.0, -1e-9, True), (1e-9, -1e-9, False)])
def test_derivatives_avoid_points_where_the_model_diverges(up, down, known):
    A = np.arange(6.0).reshape(3, 2) + 1.0
    like = Cliff(A, np.zeros(3), up, down)
    J = derivatives(like, Unknowns(2), np.zeros(2), range(2))
    assert J[:, 0, :] == pytest.approx(A if known else 0.0 * A, rel=1e-5)


def test_derivatives_use_the_fine_step_where_coarse_simulations_diverge():
    A = np.arange(6.0).reshape(3, 2) + 1.0
    like = Cliff(A, np.zeros(3), 1.0, -1.0)
    like.coarsely = False
    assert derivatives(like, Unknowns(2), np.zeros(2), range(2))[:, 0, :] == pytest.approx(A, rel=1e-5)
