"""Whether the simulation itself is to be trusted: the same model at half the step. A solver's error once looked like a
delay."""

from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.stretches import rms

LOUD = 0.5  # of the noise floor


def step_error(problem: Problem, model: Model) -> float:
    """Rms change of the weighted error of `model` by half the step, over the noise floor."""
    change = problem.of(problem.sim.finer(2)).error(model) - problem.error(model)
    return rms(change) / max(problem.floor, 1e-12)


def finding(problem: Problem, model: Model) -> str:
    """What that says, in a sentence."""
    share = step_error(problem, model)
    text = f"Half the solver's step changes the simulation by {share:.2g} of what the noise leaves"
    return f"{text}." if share < LOUD else f"{text}: too much; take the sizes of small effects with care."
