"""Free functions: what any force at a body, over speed, position, angle, command or time, would explain.

An effect without a name in the library is a function that nobody has written down. At each body, along each axis, a
force of a few hats over the recorded values is fitted beside a model. It competes with the names for the evidence, and
what it still explains beside a name says that the law of that name is not the machine's.

Source: Robinson, Root-N-consistent semiparametric regression, Econometrica 56 (1988).
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.fit import bounded_step, parallel
from rtctl.diagnose.graph.fits import Fitted
from rtctl.diagnose.graph.likelihood import Likelihood
from rtctl.diagnose.graph.linear import DAMPING, Linear
from rtctl.diagnose.graph.measures import Measures, speed
from rtctl.diagnose.scales import spaced

HATS = 10  # of a first look at each axis
FINE = 30  # of the axes that explain most
SECOND = 2  # axes that are looked at again
SMOOTH = 0.25  # of the range: distance over which a free force is alike, by its prior
SIZE = 0.3  # of the force that moves a node: standard deviation of a free force, by its prior
TURNS = 1.5  # turns from which on an angle is another axis than the position


class Free(NamedTuple):
    """A free force beside a model."""

    node: str
    axis: str
    share: float  # standard deviation of its prior, in forces that move the node
    gain: float  # nats, under the noise that it leaves
    e: np.ndarray  # (blocks, sensors) residual that it leaves
    evidence: float  # nats that it adds to the model
    knots: np.ndarray
    force: np.ndarray  # (hats,) N or Nm
    rms: float  # of the force over the recording, in forces that move the node


def free_forces(base: Fitted, shares: Sequence[float] = (SIZE,)) -> list[Free]:
    """Free forces at every body along every axis, under a prior for each of the `shares` of the force that moves the
    body; those with most evidence first."""
    sim, about = base.like.sim, Linear(base)
    measures = Measures(sim, base.model.base, {})
    places: dict[tuple[str, str], np.ndarray] = {}
    taken: set[int] = set()
    for node, ratio in sim.ratios.items():
        at = sim.layout.coordinate(node)
        if ratio != 0.0 and at not in taken:  # bodies that move as one feel one force
            taken.add(at)
            places |= {(node, axis): values for axis, values in axes(measures, node, ratio).items()}
    places = {place: values for place, values in places.items() if np.ptp(values) > 0.0}
    out = [free for place, values in places.items() for free in _fitted(about, measures, *place, values, HATS, shares)]
    out.sort(key=lambda f: -f.evidence)
    for place in list(dict.fromkeys((f.node, f.axis) for f in out))[:SECOND]:
        out += _fitted(about, measures, *place, places[place], FINE, shares)
    return sorted(out, key=lambda f: -f.evidence)


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


def _fitted(
    about: Linear, m: Measures, node: str, axis: str, values: np.ndarray, hats: int, shares: Sequence[float]
) -> list[Free]:
    base, like, sim = about.base, about.base.like, about.base.like.sim
    low, high = np.quantile(values, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(np.sort(values), low, high, hats))
    at, own = sim.layout.coordinate(node), sim.layout.ratio(node, base.model.base)
    whole = m.of("force", node)
    unit = SIZE * whole
    apart = np.abs(np.subtract.outer(*[np.arange(len(knots)) / (len(knots) - 1)] * 2))
    root = np.linalg.cholesky(np.exp(-apart / SMOOTH))  # of the prior's covariance (Ornstein and Uhlenbeck, 1930)

    def column(hat: np.ndarray) -> np.ndarray:
        forces = np.zeros((len(values), sim.layout.nq))
        forces[:, at] = own * unit * np.interp(values, knots, hat)
        out = sim.pushed(forces).run(base.model, n=like.rows[1], coarse=True)
        return np.asarray(like.of_readings(out) - about.start)

    C = np.stack(parallel([partial(column, hat) for hat in np.eye(len(knots))]), axis=2) @ root
    out = []
    for share in shares:
        scale = share / SIZE
        solved = [_solved(about, C * scale, noise) for noise in (like, like.flat(base.e))]
        solved.append(_solved(about, C * scale, like.told(max(solved, key=lambda s: s.evidence).e)))
        best = max(solved, key=lambda s: s.evidence)
        force = unit * scale * (root @ best.z)
        rms = float(np.sqrt(np.mean(np.interp(values[:: len(values) // 2000 + 1], knots, force) ** 2))) / whole
        out.append(Free(node, axis, share, best.gain, best.e, best.evidence, knots, force, rms))
    return out


class _Solved(NamedTuple):
    gain: float
    evidence: float
    e: np.ndarray
    z: np.ndarray  # (columns,) in standard deviations of the prior


def _solved(about: Linear, C: np.ndarray, noise: Likelihood) -> _Solved:
    """Parameters of the base and the columns C (blocks, sensors, k), each of variance one, that suit the residual under
    a noise."""
    base, under = about.base, about.under(noise)
    r = noise.white(base.e)
    n, k = len(base.x), C.shape[2]
    M = np.hstack([under.white, noise.filtered(C)])
    weight = np.concatenate([about.weight, np.ones(k)])
    H = M.T @ M + np.diag(weight)
    x = np.concatenate([base.x, np.zeros(k)])
    low, high = base.space.bounds()
    bounds = np.concatenate([low, np.full(k, -1e3)]), np.concatenate([high, np.full(k, 1e3)])
    dx = bounded_step(H, M.T @ r + weight * x, x, *bounds, DAMPING)
    e = about.left(dx, C)
    inner = base.power * (M.T @ M) + np.diag(weight)
    volume = np.linalg.slogdet(inner)[1] - np.sum(np.log(weight))
    if n:
        volume -= np.linalg.slogdet(inner[:n, :n])[1] - np.sum(np.log(weight[:n]))
    prior = 0.5 * float(weight @ (x + dx) ** 2 - weight[:n] @ base.x**2)
    gain = base.loss - base.like.loss(e)
    return _Solved(gain, base.power * gain - prior - 0.5 * float(volume), e, dx[n:])
