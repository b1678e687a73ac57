"""Free functions: any force at a body, or any error of a reading, over speed, position, angle, command or time.

A free function stands for an effect that the library does not name. At each body and each sensor, along each axis, a
piecewise linear function is fitted beside a model (semiparametric regression). The function competes with the named
effects for the evidence; a gain of a function beside a name shows that the law of the name is not that of the machine.

Source: Robinson, Root-N-consistent semiparametric regression, Econometrica 56 (1988).
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from rtctl.diagnose.evidence.hats import spaced
from rtctl.diagnose.evidence.places import Place, places
from rtctl.diagnose.likelihood.fits import Fitted, prior
from rtctl.diagnose.likelihood.linear import DAMPING, Linear
from rtctl.diagnose.likelihood.solver import bounded_step, parallel
from rtctl.diagnose.model.model import GraphModel

HATS = 10  # hat functions of the first fit along each axis
FINE = 30  # hat functions along the axes with the most evidence
SECOND = 2  # axes of forces, and of errors of readings, that are fitted again with FINE hats
SMOOTH = 0.25  # of the range: correlation length of a free function by its prior
NONE: Mapping[str, float] = {}
PARTS = (1.0, 0.5, 0.25)  # shares of the step of the linear model that are simulated


class Free(NamedTuple):
    """Free function beside a model."""

    place: Place
    large: bool  # whether the prior is of an unnamed effect; False: of the error of a law
    gain: float  # nats, under the noise of its residual
    e: np.ndarray  # (blocks, sensors) residual beside it, SI
    evidence: float  # nats that it adds to the evidence of the model
    knots: np.ndarray
    value: np.ndarray  # (hats,) N or Nm; an error of a reading in rad, m, rad/s or m/s
    rms: float  # over the recording, by the force that moves the node or by the spread of the reading

    @property
    def node(self) -> str:
        """Body of a force, sensor of an error."""
        return self.place.node

    @property
    def axis(self) -> str:
        """Argument of the function."""
        return self.place.axis

    def over(self, number: int) -> np.ndarray:
        """Values (n,) of the function over the rows of a recording, SI."""
        return self.place.along(self.knots, self.value, self.place.values[number])

    @property
    def kind(self) -> str:
        """Kind of the function in words."""
        return "an error of the reading" if self.place.reads else "a force"


def free_functions(base: Fitted, errors: Mapping[str, float] = NONE) -> list[Free]:
    """Free functions at every body and every sensor along every axis, the most evidence first.

    Each function is fitted as an unnamed effect. A force along an axis of `errors` is also fitted as an error of the
    laws of the model; `errors` holds its standard deviation as a share of the force that moves the body.
    """
    own = Linear(base)
    about = own, own.under(base.like.flat(base.e))  # derivatives are whitened once for all places
    out = [free for place in places(base) for free in _fitted(about, place, HATS, errors)]
    out.sort(key=lambda f: -f.evidence)
    for reads in (False, True):
        for place in list({(f.node, f.axis): f.place for f in out if f.place.reads == reads}.values())[:SECOND]:
            out += _fitted(about, place, FINE, errors)
    return sorted(out, key=lambda f: -f.evidence)


def _fitted(abouts: tuple[Linear, Linear], place: Place, hats: int, errors: Mapping[str, float]) -> list[Free]:
    base, like, start, coarse = abouts[0].base, abouts[0].base.like, abouts[0].start, abouts[0].coarse
    along = np.sort(np.concatenate(place.values))
    low, high = np.quantile(along, (1e-3, 1.0 - 1e-3))
    knots = np.unique(spaced(along, low, high, hats))
    unit = place.size * place.whole
    apart = np.abs(np.subtract.outer(*[np.arange(len(knots)) / max(len(knots) - 1, 1)] * 2))
    root = np.linalg.cholesky(np.exp(-apart / SMOOTH))  # prior covariance (Ornstein and Uhlenbeck, 1930)

    def change(hat: np.ndarray, model: GraphModel) -> np.ndarray:
        """Change (blocks, sensors) of the residual of coarse simulations by a free function, SI."""
        found = [
            place.run(part, model, unit * place.along(knots, hat, own), coarse)
            for part, own in zip(like.parts, place.values, strict=True)
        ]
        return np.asarray(np.concatenate(found) - start)

    def moved(scale: float, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        return change(scale * (root @ z), base.space.model(x))

    C = np.stack(parallel([partial(change, hat, base.model) for hat in np.eye(len(knots))]), axis=2) @ root
    out = []
    small = errors.get(place.axis, 0.0) / place.size if not place.reads else 0.0
    for scale in (1.0, small) if small else (1.0,):
        solved = [_solved(about, C * scale) for about in abouts]
        left = max(solved, key=lambda s: s.evidence).e
        solved.append(_solved(abouts[0].under(like.told(left)), C * scale))
        best = max(solved, key=lambda s: s.evidence)
        if best.evidence > 0.0:
            best = _simulated(base, best, partial(moved, scale))
        value = unit * scale * (root @ best.z)
        rms = float(np.sqrt(np.mean(place.along(knots, value, along[:: len(along) // 2000 + 1]) ** 2))) / place.whole
        out.append(Free(place, scale == 1.0, best.gain, best.e, best.evidence, knots, value, rms))
    return out


class _Solved(NamedTuple):
    gain: float
    evidence: float
    e: np.ndarray
    z: np.ndarray  # (columns,) in standard deviations of the prior
    dx: np.ndarray  # step of the parameters of the base
    volume: float  # log determinant of the posterior precision over the prior's, nats


def _simulated(base: Fitted, solved: _Solved, change: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> _Solved:
    """Solution by simulation, at the share of the step with the most evidence.

    Slip of dry friction and contact in a gap are not linear in the hat functions.
    """
    tried = []
    for part in PARTS:
        dx, z = part * solved.dx, part * solved.z
        e = base.e + change(base.x + dx, z)
        tried.append(_judged(base, e, dx, z, solved.volume))
    return max(tried, key=lambda s: s.evidence)


def _judged(base: Fitted, e: np.ndarray, dx: np.ndarray, z: np.ndarray, volume: float) -> _Solved:
    """Gain and evidence of a step of the parameters and a free function, from the residuals e (blocks, sensors)."""
    weight = prior(base.space)
    odds = 0.5 * float(weight @ ((base.x + dx) ** 2 - base.x**2) + z @ z)
    gain = base.loss - base.like.loss(e)
    return _Solved(gain, base.power * gain - odds - 0.5 * volume, e, z, dx, volume)


def _solved(about: Linear, C: np.ndarray) -> _Solved:
    """Least-squares solution of the parameters of the base and of the columns C (blocks, sensors, k), each of prior
    variance one, under the noise of `about`."""
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
