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
    measures = Measures(sim, base.model.base, {})
    out = []
    for node, ratio in sim.ratios.items():
        if ratio == 0.0:
            continue
        for axis, values in axes(measures, node).items():
            out.append(_fitted(about, measures, node, axis, values))
    return sorted(out, key=lambda f: -f.gain)


def axes(m: Measures, node: str) -> dict[str, np.ndarray]:
    """Values (n,) of each axis at a body."""
    sim = m.sim
    x = m.way(node)
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


def _fitted(about: Linear, m: Measures, node: str, axis: str, values: np.ndarray) -> Free:
    base, like, sim = about.base, about.like, about.like.sim
    low, high = np.quantile(values, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(np.sort(values), low, high, HATS))
    at, own = sim.layout.coordinate(node), sim.layout.ratio(node, base.model.base)
    unit = 0.1 * m.of("force", node)

    def column(hat: np.ndarray) -> np.ndarray:
        forces = np.zeros((len(values), sim.layout.nq))
        forces[:, at] = own * unit * np.interp(values, knots, hat)
        out = sim.pushed(forces).run(base.model, n=like.rows[1], coarse=True)
        return np.asarray(like.of_readings(out) - about.start)

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
    volume = np.linalg.slogdet(inner)[1] - np.sum(np.log(weight))
    if n:
        volume -= np.linalg.slogdet(inner[:n, :n])[1] - np.sum(np.log(weight[:n]))
    return Free(node, axis, base.loss - like.loss(e), e, 0.5 * float(volume), knots, unit * dx[n:])
