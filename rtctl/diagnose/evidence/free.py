"""Free functions: what any force at a body, over speed, position, angle, command or time, would explain.

An effect without a name in the library is a function that nobody has written down. At each body, along each axis, a
force of a few hats is fitted beside a model. It competes with the names for the evidence, and what it still explains
beside a name says that the law of that name is not the machine's. Position and speed are those of the model, as its
observer has them: the speed of a recording that counts knows of a step before it comes, and a force by it pushes ahead.

Source: Robinson, Root-N-consistent semiparametric regression, Econometrica 56 (1988).
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.evidence.hats import spaced
from rtctl.diagnose.likelihood.fits import Fitted, prior
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.likelihood.linear import DAMPING, Linear
from rtctl.diagnose.likelihood.solver import bounded_step, parallel
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import Measures

HATS = 10  # of a first look at each axis
FINE = 30  # of the axes that explain most
SECOND = 2  # axes that are looked at again
SMOOTH = 0.25  # of the range: distance over which a free force is alike, by its prior
SIZE = 0.3  # of the force that moves a node: standard deviation of a free force, by its prior
PARTS = (1.0, 0.5, 0.25)  # of the step of the linear model, at which it is simulated
TIME = "time"  # axis along which a force comes and goes
AXES = ("velocity", "position", TIME, "angle", "command")
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
    sim, own = base.like.sim, Linear(base)
    about = own, own.under(base.like.flat(base.e))  # the parameters are filtered once for all places
    every = [Measures(part.sim, base.model.base, {}) for part in base.like.parts]
    told = [Measures(part.sim.seen_by(base.model), base.model.base, {}) for part in base.like.parts]
    places: dict[tuple[str, str], list[np.ndarray]] = {}
    taken: set[int] = set()
    for node, ratio in sim.ratios.items():
        at = sim.layout.coordinate(node)
        if ratio == 0.0 or at in taken:  # bodies that move as one feel one force
            continue
        taken.add(at)
        found = [axes(measures, node) for measures in told]
        for axis in found[0]:
            if all(axis in values for values in found):
                places[node, axis] = after(axis, [values[axis] for values in found])
    places = {place: values for place, values in places.items() if np.ptp(np.concatenate(values)) > 0.0}
    out = [free for place, values in places.items() for free in _fitted(about, every, *place, values, HATS, shares)]
    out.sort(key=lambda f: -f.evidence)
    for place in list(dict.fromkeys((f.node, f.axis) for f in out))[:SECOND]:
        out += _fitted(about, every, *place, places[place], FINE, shares)
    return sorted(out, key=lambda f: -f.evidence)


def axes(m: Measures, node: str) -> dict[str, np.ndarray]:
    """Values (n,) of each axis at a body."""
    sim = m.sim
    x = m.way(node)
    out = {
        "velocity": np.diff(x, prepend=x[:1]) / sim.record.dt,
        "position": x,
        TIME: sim.record.t - sim.record.t[0],
    }
    if m.turns(node) and np.ptp(x) > TURNS * 2 * np.pi:
        out["angle"] = np.mod(x, 2 * np.pi)
    if sim.volts.shape[1] and sim.case.problem != "static":  # where the force is what the model predicts
        out["command"] = sim.volts[:, 0]
    return out


def after(axis: str, values: list[np.ndarray]) -> list[np.ndarray]:
    """Values of an axis in each recording; the time of each begins where that of the one before ends."""
    if axis != TIME:
        return values
    ends = np.cumsum([0.0, *(v[-1] for v in values)])
    return [v + end for v, end in zip(values, ends, strict=False)]


def _fitted(
    abouts: tuple[Linear, Linear],
    every: list[Measures],
    node: str,
    axis: str,
    values: list[np.ndarray],
    hats: int,
    shares: Sequence[float],
) -> list[Free]:
    base, like, start = abouts[0].base, abouts[0].base.like, abouts[0].start
    along = np.sort(np.concatenate(values))
    low, high = np.quantile(along, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(along, low, high, hats))
    whole = max(m.of("force", node) for m in every)
    unit = SIZE * whole
    apart = np.abs(np.subtract.outer(*[np.arange(len(knots)) / (len(knots) - 1)] * 2))
    root = np.linalg.cholesky(np.exp(-apart / SMOOTH))  # of the prior's covariance (Ornstein and Uhlenbeck, 1930)

    def pushed(part: Likelihood, values: np.ndarray, hat: np.ndarray, model: GraphModel) -> np.ndarray:
        sim, model = part.sim, part.sim.own(model)
        forces = np.zeros((len(values), sim.layout.nq))
        own = sim.layout.ratio(node, model.base)
        forces[:, sim.layout.coordinate(node)] = own * unit * np.interp(values, knots, hat)
        return part.of_readings(sim.pushed(forces).run(model, n=part.rows[1], coarse=abouts[0].coarse))

    def change(hat: np.ndarray, model: GraphModel) -> np.ndarray:
        """What a force by hats does to the residuals (blocks, sensors) of coarse simulations."""
        found = [pushed(part, own, hat, model) for part, own in zip(like.parts, values, strict=True)]
        return np.asarray(np.concatenate(found) - start)

    def moved(scale: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        return change(scale * (root @ z), base.space.model(x))

    C = np.stack(parallel([partial(change, hat, base.model) for hat in np.eye(len(knots))]), axis=2) @ root
    out = []
    for share in shares:
        scale = share / SIZE
        solved = [_solved(about, C * scale) for about in abouts]
        left = max(solved, key=lambda s: s.evidence).e
        solved.append(_solved(abouts[0].under(like.told(left)), C * scale))
        best = max(solved, key=lambda s: s.evidence)
        if best.evidence > 0.0:
            best = _simulated(base, best, partial(moved, scale))
        force = unit * scale * (root @ best.z)
        rms = float(np.sqrt(np.mean(np.interp(along[:: len(along) // 2000 + 1], knots, force) ** 2))) / whole
        out.append(Free(node, axis, share, best.gain, best.e, best.evidence, knots, force, rms))
    return out


class _Solved(NamedTuple):
    gain: float
    evidence: float
    e: np.ndarray
    z: np.ndarray  # (columns,) in standard deviations of the prior
    dx: np.ndarray  # step of the base's parameters
    volume: float  # of the posterior, nats


def _simulated(base: Fitted, solved: _Solved, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> _Solved:
    """The same as a simulation has it, as far along the step as it gains most.

    What lets go of dry friction, or closes a gap, is no sum of what single hats did.
    """
    tried = []
    for part in PARTS:
        dx, z = part * solved.dx, part * solved.z
        e = base.e + change(base.x + dx, z)
        tried.append(_judged(base, e, dx, z, solved.volume))
    return max(tried, key=lambda s: s.evidence)


def _judged(base: Fitted, e: np.ndarray, dx: np.ndarray, z: np.ndarray, volume: float) -> _Solved:
    """What a step of the parameters and a free force gain, that leave the residuals e (blocks, sensors)."""
    weight = prior(base.space)
    odds = 0.5 * float(weight @ ((base.x + dx) ** 2 - base.x**2) + z @ z)
    gain = base.loss - base.like.loss(e)
    return _Solved(gain, base.power * gain - odds - 0.5 * volume, e, z, dx, volume)


def _solved(about: Linear, C: np.ndarray) -> _Solved:
    """Parameters of the base and the columns C (blocks, sensors, k), each of variance one, that suit the residual under
    the noise of `about`."""
    base, noise = about.base, about.like
    r = noise.white(base.e)
    n, k = len(base.x), C.shape[2]
    M = np.hstack([about.white, noise.white(C)])
    weight = np.concatenate([about.weight, np.ones(k)])
    H = M.T @ M + np.diag(weight)
    x = np.concatenate([base.x, np.zeros(k)])
    low, high = base.space.bounds()
    bounds = np.concatenate([low, np.full(k, -1e3)]), np.concatenate([high, np.full(k, 1e3)])
    dx = bounded_step(H, M.T @ r + weight * x, x, *bounds, DAMPING)
    e = about.left(dx, C)
    inner = base.power * (M.T @ M) + np.diag(weight)
    volume = np.linalg.slogdet(inner)[1]
    if n:
        volume -= np.linalg.slogdet(inner[:n, :n])[1]
    return _judged(base, e, dx[:n], dx[n:], float(volume))
