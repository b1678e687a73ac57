"""Fits the owner's parameters first: a wrong value is not missing physics.

Where dry friction holds and lets go, a small change of a parameter moves the moment at which a machine breaks loose.
The cost has troughs of its own then, and what a fit from the owner's values leaves looks like an effect. So a base that
is near the noise is fitted from places all over the tolerance as well. A speed that is shown without its sign would be
followed by absurd values: they are fitted as if that were known.
"""

from functools import partial

import numpy as np

from rtctl.diagnose.decide import COMPLETE
from rtctl.diagnose.fit import Fit, fit, parallel
from rtctl.diagnose.hypotheses import hypotheses
from rtctl.diagnose.model import free_parameters, owner_model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.simulate import Simulator
from rtctl.diagnose.space import WIDE, Space
from rtctl.diagnose.tacho import unsigned
from rtctl.plants.physics import only

AGAIN = 4  # fits from where the last one stopped
NEAR = 2.5  # times the noise floor: a base this close is worth every round
TROUGHS = (1.1, 4.5)  # times the noise floor: below there is nothing to gain, above one trough takes all
SPREAD = {"ivu": 2, "ldu": 8, "axis": 2}  # other starts: a reel unit and an axis seldom have two troughs
PAIRS = {  # whose ratio makes a trough of its own: which motor is the heavier, and where a spring and its mass ring
    "ivu": (("J_m1", "J_m2"),), "ldu": (("k_c", "M"),), "axis": (),
}  # fmt: skip
UNFOLDED = 0.8  # of the cost
AWAY = 0.8  # of the tolerance


def base_fit(sim: Simulator, problem: Problem, start: np.ndarray | None = None) -> Fit:
    """The owner's model with its parameters as the record wants them, within their tolerance; from x = `start` alone if
    it is given."""
    owner = owner_model(sim.case, sim.record)
    space = Space(owner, free_parameters(sim.case, owner), sim.case.tolerance)
    fitted = settle(problem, fit(problem, space, start))
    starts = []
    if start is None and space.names and TROUGHS[0] * problem.floor < fitted.rms < TROUGHS[1] * problem.floor:
        starts += spread(space, fitted.x, SPREAD[sim.record.plant])
    if fitted.rms > COMPLETE * problem.floor:
        starts += pairs(space, fitted.x, sim.record.plant)
    for other in parallel([partial(fit, problem, space, x, rounds=12) for x in starts]):
        if other.cost < 0.98 * fitted.cost:
            fitted = settle(problem, other)
    return unfolded(problem, fitted) if unsigned(sim.record) else fitted


def unfolded(problem: Problem, fitted: Fit) -> Fit:
    """The parameters that follow a speed without its sign best once the sensor is told not to know direction; `fitted`
    where that explains no more. No values of theirs make a machine go one way only."""
    space, record = fitted.space, problem.sim.record
    (blind,) = hypotheses(record, fitted.model.base, only=(only("unsigned"),))
    starts = (fitted.x, np.zeros(len(space.names)))
    both = min((settle(problem, fit(problem, space.add(blind), x)) for x in starts), key=lambda f: f.cost)
    return fit(problem, space, both.x[: space.nb], rounds=0) if both.cost < UNFOLDED * fitted.cost else fitted


def spread(space: Space, x: np.ndarray, count: int) -> list[np.ndarray]:
    """Places all over the tolerance; what has none stays where it is in x (parameters,)."""
    return [np.where(space.reach() < WIDE, other, x) for other in space.spread(count)]


def pairs(space: Space, x: np.ndarray, plant: str) -> list[np.ndarray]:
    """Places beside x (parameters,) where one of a pair is larger and the other smaller, and the other way."""
    low, high = space.bounds()
    out = []
    for pair in PAIRS[plant]:
        for sides in ((high, low), (low, high)):
            other = x.copy()
            for name, side in zip(pair, sides, strict=True):
                if name in space.names:
                    other[space.names.index(name)] = AWAY * side[space.names.index(name)]
            out.append(other)
    return out


def settle(problem: Problem, fitted: Fit) -> Fit:
    """Fit on until it gains nothing."""
    for _ in range(AGAIN):
        enough = 1e-4 if fitted.rms < NEAR * problem.floor else 2e-3
        better = fit(problem, fitted.space, fitted.x, rounds=10, enough=enough)
        gained, fitted = better.cost < 0.98 * fitted.cost, better
        if not gained:
            break
    return fitted
