"""Free functions: what any force at a body, over speed, position, angle, command or time, would explain.

An effect without a name in the library is a function that nobody has written down. At each body, along each axis, a
force of a few hats over the recorded values is fitted beside a model. It competes with the names for the evidence, and
what it still explains beside a name says that the law of that name is not the machine's.

Source: Robinson, Root-N-consistent semiparametric regression, Econometrica 56 (1988).
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import bounded_step, parallel
from rtctl.diagnose.graph.fits import Fitted
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.graph.linear import DAMPING, Linear
from rtctl.diagnose.graph.measures import Measures, speed
from rtctl.diagnose.scales import spaced

HATS = 10
TURNS = 1.5  # turns from which on an angle is another axis than the position


class Free(NamedTuple):
    """A free force beside a model."""

    node: str
    axis: str
    gain: float  # nats, under the noise that it leaves
    e: np.ndarray  # (blocks, sensors) residual that it leaves
    volume: float  # ln of the posterior's volume over the prior's, nats
    knots: np.ndarray
    force: np.ndarray  # (hats,) N or Nm


def free_forces(base: Fitted) -> list[Free]:
    """Free forces at every body along every axis, best first."""
    sim, about = base.like.sim, Linear(base)
    every = [Measures(part.sim, base.model.base, {}) for part in base.like.parts]
    out = []
    for node, ratio in sim.ratios.items():
        if ratio == 0.0:
            continue
        found = [axes(measures, node, ratio) for measures in every]
        for axis in found[0]:
            if all(axis in own for own in found):
                out.append(_fitted(about, every, node, axis, after(axis, [own[axis] for own in found])))
    return sorted(out, key=lambda f: -f.gain)


def axes(m: Measures, node: str, ratio: float) -> dict[str, np.ndarray]:
    """Values (n,) of each axis at a body."""
    sim = m.sim
    x = m.way * ratio
    out = {
        "velocity": speed(x, sim.record.dt),
        "position": x,
        "time": sim.record.t - sim.record.t[0],
    }
    if m.turns(node) and np.ptp(x) > TURNS * 2 * np.pi:
        out["angle"] = np.mod(x, 2 * np.pi)
    if sim.volts.shape[1]:
        out["command"] = sim.volts[:, 0]
    return out


def after(axis: str, values: list[np.ndarray]) -> list[np.ndarray]:
    """Values of an axis in each recording; the time of each begins where that of the one before ends."""
    if axis != "time":
        return values
    ends = np.cumsum([0.0, *(v[-1] for v in values)])
    return [v + end for v, end in zip(values, ends, strict=False)]


def _fitted(about: Linear, every: list[Measures], node: str, axis: str, values: list[np.ndarray]) -> Free:
    base, like = about.base, about.like
    whole = np.sort(np.concatenate(values))
    low, high = np.quantile(whole, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(whole, low, high, HATS))
    unit = 0.1 * max(m.of("force", node) for m in every)

    def pushed(part: Likelihood, along: np.ndarray, hat: np.ndarray) -> np.ndarray:
        sim, model = part.sim, part.sim.own(base.model)
        forces = np.zeros((len(along), sim.layout.nq))
        own = sim.layout.ratio(node, model.base)
        forces[:, sim.layout.coordinate(node)] = own * unit * np.interp(along, knots, hat)
        return part.of_readings(sim.pushed(forces).run(model, n=part.rows[1], coarse=True))

    def column(hat: np.ndarray) -> np.ndarray:
        found = [pushed(part, along, hat) for part, along in zip(like.parts, values, strict=True)]
        return np.asarray(np.concatenate(found) - about.start)

    C = np.stack(parallel([partial(column, hat) for hat in np.eye(len(knots))]), axis=2)
    white, r = like.filtered(C), like.white(base.e)
    n, k = len(base.x), C.shape[2]
    M = np.hstack([about.white, white])
    weight = np.concatenate([about.weight, np.full(k, 1.0 / 9.0)])
    H = M.T @ M + np.diag(weight)
    x = np.concatenate([base.x, np.zeros(k)])
    low_x, high_x = base.space.bounds()
    bounds = np.concatenate([low_x, np.full(k, -1e3)]), np.concatenate([high_x, np.full(k, 1e3)])
    dx = bounded_step(H, M.T @ r + weight * x, x, *bounds, DAMPING)
    e = about.left(dx, C)
    inner = base.power * (M.T @ M) + np.diag(weight)
    volume = np.linalg.slogdet(inner)[1] - np.sum(np.log(weight[n:]))
    if n:
        volume -= np.linalg.slogdet(inner[:n, :n])[1]
    return Free(node, axis, base.loss - like.loss(e), e, 0.5 * float(volume), knots, unit * dx[n:])
