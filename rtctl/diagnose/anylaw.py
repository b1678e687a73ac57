"""What a further term does that no form of the laws beside it could do.

No law is the machine's own to the last per cent, and the pattern that its form leaves is followed by some other law. So
a static law that was found is set free: at its node, any function of what it depends on may push besides, as ten hats
over the values that the recording has. What a further term still takes off is not the form of the first.

Source: Robinson, Root-N-consistent semiparametric regression, Econometrica 56 (1988), with hats for his kernel.
"""

from functools import partial

import numpy as np

from rtctl.diagnose.fit import Fit, parallel, trust
from rtctl.diagnose.model import Model
from rtctl.diagnose.problem import Problem
from rtctl.diagnose.scales import spaced, speed
from rtctl.diagnose.simulate import Simulator, gear, way
from rtctl.diagnose.space import Hypothesis
from rtctl.plants.physics import TERMS

HATS = 10
STEP = 1e-3  # of the rms of all voltages, of a difference quotient
RIDGE = 1e-9  # of the largest column, for what no hat can show


def static(fitted: Fit) -> bool:
    """Whether all that was found are functions that can be set free."""
    return all(TERMS[h.term].static for h in fitted.space.hypotheses)


def freed(problem: Problem, before: Fit, after: Fit) -> tuple[np.ndarray, np.ndarray]:
    """Errors (errors,) of two fits once the laws of the first may be any function, linear about each of them."""
    hats = pushed(problem, before.model, before.space.hypotheses)
    return refitted(before, hats), refitted(after, hats)


def pushed(problem: Problem, model: Model, laws: tuple[Hypothesis, ...]) -> np.ndarray:
    """How the errors (errors, hats) change with a push along each hat of each law, by the volt."""
    sim = problem.sim
    step, r = STEP * float(np.std(sim.volts)), problem.residual(model)

    def column(push: np.ndarray) -> np.ndarray:
        return (problem.of(sim.commanded(sim.volts + step * push)).residual(model) - r) / step

    pushes = [np.outer(hat, drives(sim, h.node)) for h in laws for hat in hats(abscissa(sim, model, h))]
    return np.stack(parallel([partial(column, push) for push in pushes]), axis=1)


def drives(sim: Simulator, node: str) -> np.ndarray:
    """Share (drives,) of each drive in a push at a node: its own, or both where it stands between them."""
    count = sim.volts.shape[1]
    if count == 1:
        return np.ones(1)
    return np.array({"1": (1.0, 0.0), "2": (0.0, 1.0)}.get(node[-1:], (0.5, -0.5)))


def abscissa(sim: Simulator, model: Model, law: Hypothesis) -> np.ndarray:
    """Values (n,) of what a law depends on, up to a factor."""
    record = sim.record
    x = way(record)
    along = TERMS[law.term].axis
    if along == "velocity":
        return speed(x, record.plant, record.dt)
    if along == "command":
        return sim.volts @ np.abs(drives(sim, law.node))
    if along == "angle" and record.case.sensors.unit != "m":
        return np.mod(gear(record.plant, model.base, law.node) * x, 2 * np.pi)
    return x


def hats(values: np.ndarray) -> np.ndarray:
    """Functions (HATS or fewer, n) of values (n,) that are one at a knot, zero at the next, and sum to one.

    Knots are dense where the values are, but reach to where they seldom are.
    """
    low, high = np.quantile(values, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(np.sort(values), low, high, HATS))
    return np.array([np.interp(values, knots, one) for one in np.eye(len(knots))])


def refitted(fitted: Fit, hats: np.ndarray) -> np.ndarray:
    """Errors (errors,) once all numbers of the fit and the pushes `hats` are moved to where linear errors are least."""
    M = np.hstack([fitted.J, hats])
    own = fitted.space.prior() * trust(fitted.r)
    weights = np.concatenate([own, np.full(hats.shape[1], RIDGE * float(np.sum(hats**2, axis=0).max()))])
    slope = M.T @ fitted.r
    slope[: len(own)] += own * fitted.x
    H = M.T @ M + np.diag(weights)
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    return fitted.r - M @ (np.linalg.lstsq(H / np.outer(scale, scale), slope / scale, rcond=1e-10)[0] / scale)
