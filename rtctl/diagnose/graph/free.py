"""Free functions: what any force at a body, over speed, position, angle, command or time, would explain.

An effect without a name in the library is a function that nobody has written down. At each body, along each axis, a
force of a few hats over the recorded values is fitted beside a model. It competes with the names for the evidence, and
what it still explains beside a name says that the law of that name is not the machine's.

Source: Robinson, Root-N-consistent semiparametric regression, Econometrica 56 (1988).
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.fit import bounded_step, parallel
from rtctl.diagnose.graph.fits import Fitted, prior
from rtctl.diagnose.graph.measures import SMOOTH, Measures
from rtctl.diagnose.graph.screen import raw_jacobian
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
    like, sim = base.like, base.like.sim
    Jraw = raw_jacobian(base)
    start = like.raw(base.model, True)
    measures = Measures(sim, base.model.base, {})
    out = []
    for node, ratio in sim.ratios.items():
        if ratio == 0.0:
            continue
        for axis, values in axes(measures, node, ratio).items():
            out.append(_fitted(base, Jraw, start, measures, node, axis, values))
    return sorted(out, key=lambda f: -f.gain)


def axes(m: Measures, node: str, ratio: float) -> dict[str, np.ndarray]:
    """Values (n,) of each axis at a body."""
    sim = m.sim
    x, dt = m.way * ratio, sim.record.dt
    out = {
        "velocity": np.gradient(uniform_filter1d(x, 2 * max(1, round(SMOOTH / dt)) + 1), dt),
        "position": x,
        "time": sim.record.t - sim.record.t[0],
    }
    if m.turns(node) and np.ptp(x) > TURNS * 2 * np.pi:
        out["angle"] = np.mod(x, 2 * np.pi)
    if sim.volts.shape[1]:
        out["command"] = sim.volts[:, 0]
    return out


def _fitted(
    base: Fitted, Jraw: np.ndarray, start: np.ndarray, m: Measures, node: str, axis: str, values: np.ndarray
) -> Free:
    like, sim = base.like, base.like.sim
    low, high = np.quantile(values, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(np.sort(values), low, high, HATS))
    at, own = sim.layout.coordinate(node), sim.layout.ratio(node, base.model.base)
    unit = 0.1 * m.of("force", node)

    def column(hat: np.ndarray) -> np.ndarray:
        forces = np.zeros((len(values), sim.layout.nq))
        forces[:, at] = own * unit * np.interp(values, knots, hat)
        return np.asarray(like.of_readings(sim.pushed(forces).run(base.model, n=like.rows[1], coarse=True)) - start)

    C = np.stack(parallel([partial(column, hat) for hat in np.eye(len(knots))]), axis=2)
    C = np.where(np.isfinite(C), C, 0.0)
    W, white, r = like.filtered(Jraw), like.filtered(C), like.white(base.e)
    n, k = len(base.x), C.shape[2]
    M = np.hstack([W, white])
    weight = np.concatenate([prior(base.space), np.full(k, 1.0 / 9.0)])
    H = M.T @ M + np.diag(weight)
    x = np.concatenate([base.x, np.zeros(k)])
    low_x, high_x = base.space.bounds()
    bounds = np.concatenate([low_x, np.full(k, -1e3)]), np.concatenate([high_x, np.full(k, 1e3)])
    dx = bounded_step(H, M.T @ r + weight * x, x, *bounds, 1e-9)
    e = base.e + np.tensordot(Jraw, dx[:n], axes=1) + np.tensordot(C, dx[n:], axes=1)
    inner = base.power * (M.T @ M) + np.diag(weight)
    volume = np.linalg.slogdet(inner)[1] - np.sum(np.log(weight))
    if n:
        volume -= np.linalg.slogdet(inner[:n, :n])[1] - np.sum(np.log(weight[:n]))
    return Free(node, axis, base.loss - like.loss(e), e, 0.5 * float(volume), knots, unit * dx[n:])
