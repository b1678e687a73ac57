"""Fits the owner's parameters first: a wrong value is not missing physics."""

from rtctl.diagnose.fit import Fit, Problem, fit
from rtctl.diagnose.model import free_parameters, owner_model
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import Space

AGAIN = 4  # fits from where the last one stopped
NEAR = 2.5  # times the noise floor: a base this close is worth every round


def base_fit(sim: Simulator, problem: Problem) -> Fit:
    """The owner's model with its parameters as the record wants them, within their tolerance."""
    owner = owner_model(sim.case, sim.record)
    space = Space(owner, free_parameters(sim.case, owner), sim.case.tolerance)
    fitted = fit(problem, space)
    for _ in range(AGAIN):
        better = fit(problem, space, fitted.x, rounds=10, enough=1e-4 if fitted.rms < NEAR * problem.floor else 2e-3)
        gained, fitted = better.cost < 0.98 * fitted.cost, better
        if not gained:
            break
    return fitted
