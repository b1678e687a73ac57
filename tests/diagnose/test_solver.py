"""Half the step changes little where the solver is right, and is told where it is not."""

import numpy as np

from rtctl.diagnose.problem import Problem
from rtctl.diagnose.solver import finding, step_error


def test_a_smooth_machine_hardly_asks_for_shorter_steps(plain):
    problem = Problem(plain.sim)
    assert 0.0 < step_error(problem, plain.model) < 0.1
    assert "too much" not in finding(problem, plain.model)


def test_a_step_that_is_too_long_is_told(plain, monkeypatch):
    problem = Problem(plain.sim)
    exact = Problem.error

    def rough(self, model, coarse=False):
        error = exact(self, model, coarse)
        wrong = 9.0 * np.sign(np.sin(np.arange(len(error))))[:, None]
        return error + wrong if self.sim is problem.sim else error

    monkeypatch.setattr(Problem, "error", rough)
    assert step_error(problem, plain.model) > 1.0
    assert "too much" in finding(problem, plain.model)
