"""Fits the owner's parameters first: a wrong value is not missing physics."""

import numpy as np

from rtctl.diagnose.decide import COMPLETE
from rtctl.diagnose.fit import Fit, fit
from rtctl.diagnose.model import free_parameters, owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import Space

AGAIN = 4  # fits from where the last one stopped
NEAR = 2.5  # times the noise floor: a base this close is worth every round
RINGS = {"ivu": (), "ldu": (("k_c", "M"),), "axis": ()}  # spring and mass: another frequency is a trough of its own
AWAY = 0.8  # of the tolerance


def base_fit(sim: Simulator, problem: Problem, start: np.ndarray | None = None) -> Fit:
    """The owner's model with its parameters as the record wants them, within their tolerance; from x = `start`."""
    owner = owner_model(sim.case, sim.record)
    space = Space(owner, free_parameters(sim.case, owner), sim.case.tolerance)
    fitted = settle(problem, fit(problem, space, start))
    if fitted.rms < COMPLETE * problem.floor:
        return fitted
    low, high = space.bounds()
    for spring, mass in RINGS[sim.record.plant]:
        for up, down in ((high, low), (low, high)):
            x = fitted.x.copy()
            for name, side in ((spring, up), (mass, down)):
                if name in space.names:
                    x[space.names.index(name)] = AWAY * side[space.names.index(name)]
            other = fit(problem, space, x, rounds=12)
            if other.cost < 0.98 * fitted.cost:
                fitted = settle(problem, other)
    return fitted


def settle(problem: Problem, fitted: Fit) -> Fit:
    """Fit on until it gains nothing."""
    for _ in range(AGAIN):
        enough = 1e-4 if fitted.rms < NEAR * problem.floor else 2e-3
        better = fit(problem, fitted.space, fitted.x, rounds=10, enough=enough)
        gained, fitted = better.cost < 0.98 * fitted.cost, better
        if not gained:
            break
    return fitted
