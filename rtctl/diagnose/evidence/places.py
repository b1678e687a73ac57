"""Places of a free function: a force at a body, or an error of the reading of a sensor, along one axis.

Position and speed are those of the model under an observer of the usual bandwidth. The differentiated reading of a
counter is not causal: a force over it acts before the step. The speed of a quick observer contains the noise of the
reading: a force over it would be another observer.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from rtctl.diagnose.calibration import FREE_ERROR, FREE_FORCE
from rtctl.diagnose.likelihood.fits import Fitted
from rtctl.diagnose.likelihood.likelihood import Likelihood
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import Measures
from rtctl.diagnose.model.simulate import HELD

TIME = "time"  # axis of a time-varying force
AXES = ("velocity", "position", TIME, "angle", "command")
TURNS = 1.5  # turns: least range of a rotary motion for which the angle is an axis beside the position


class Place(NamedTuple):
    """Place of a free function."""

    node: str  # body or sensor
    axis: str
    values: list[np.ndarray]  # (n,) values of the axis in each recording
    whole: float  # force that moves the body, or spread of the reading, SI
    reads: bool  # whether the function is an error of a reading

    @property
    def size(self) -> float:
        """Prior standard deviation of the function, by `whole`."""
        return FREE_ERROR if self.reads else FREE_FORCE

    def along(self, knots: np.ndarray, hat: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Values (n,) of the function that is `hat` at the knots. An error of a reading is a cubic spline: a corner
        would be a jump of the speed."""
        if self.reads and len(knots) > 2:
            inside = np.clip(values, knots[0], knots[-1])
            return np.asarray(CubicSpline(knots, hat, bc_type="natural")(inside))
        return np.interp(values, knots, hat)

    def run(self, part: Likelihood, model: GraphModel, value: np.ndarray, coarse: bool) -> np.ndarray:
        """Residual (blocks, sensors) of a recording under a model with the function (n,), SI."""
        sim, model, n = part.sim, part.sim.own(model), part.rows[1]
        if self.reads:
            return part.of_readings(sim.misread(self.node, value).run(model, n=n, coarse=coarse))
        forces = np.zeros((len(value), sim.layout.nq))
        own = sim.layout.ratio(self.node, model.base)
        forces[:, sim.layout.coordinate(self.node)] = own * value
        return part.of_readings(sim.pushed(forces).run(model, n=n, coarse=coarse))


def places(fit: Fitted) -> list[Place]:
    """Places of forces at every body and of errors of every reading, along every axis of the recordings."""
    sim, base = fit.like.sim, fit.model.base
    every = [Measures(part.sim, base, {}) for part in fit.like.parts]
    told = [Measures(part.sim.usual().seen_by(fit.model), base, {}) for part in fit.like.parts]
    found: list[Place] = []
    taken: set[int] = set()
    for body, ratio in sim.ratios.items():
        at = sim.layout.coordinate(body)
        if ratio == 0.0 or at in taken:  # rigidly joined bodies share one coordinate and one force
            continue
        taken.add(at)
        found += _of(told, body, body, max(m.of("force", body) for m in every), False)
    for sensor in _read(fit):
        spread = max(float(np.std(part.sim.record.y[sensor])) for part in fit.like.parts)
        body = fit.like.sim.case.machine.sensors[sensor].body or str(sim.body)
        sampled = [_sampled(place, fit) for place in _of(told, sensor, body, spread, True)]
        measures = sim.case.machine.sensors[sensor].measures
        found += [place for place in sampled if not told_otherwise(place.axis, measures)]
    return [place for place in found if np.ptp(np.concatenate(place.values)) > 0.0]


def told_otherwise(axis: str, measures: str) -> bool:
    """Whether an error of a reading along an axis has another name: an error over time is coloured noise, and an error
    of a position over speed is a delay."""
    return axis == TIME or (axis == "velocity" and measures == "position")


def _read(fit: Fitted) -> list[str]:
    """Sensors whose readings a model predicts in every recording."""
    sims = [part.sim for part in fit.like.parts]
    held = {sims[0].main} if sims[0].mode == HELD else set()
    return [
        name
        for name in sims[0].channels
        if name in sims[0].layout.sensors
        and name not in held
        and all(name in s.channels and name not in s.edges for s in sims)
    ]


def _sampled(place: Place, fit: Fitted) -> Place:
    """Place of an error of a reading, whose command is the one in force before the sensor was read.

    The command that is computed from the reading follows the noise of the reading and would explain that noise.
    """
    if place.axis != "command":
        return place
    late = [1 + int(part.sim.case.delay_samples) for part in fit.like.parts]
    shifted = [np.concatenate([u[:1].repeat(k), u[:-k]]) for k, u in zip(late, place.values, strict=True)]
    return place._replace(values=shifted)


def _of(told: list[Measures], node: str, body: str, whole: float, reads: bool) -> list[Place]:
    """Places of one node that moves with a body."""
    found = [axes(measures, body) for measures in told]
    return [
        Place(node, axis, after(axis, [values[axis] for values in found]), whole, reads)
        for axis in found[0]
        if all(axis in values for values in found)
    ]


def axes(m: Measures, body: str) -> dict[str, np.ndarray]:
    """Values (n,) of each axis at a body."""
    sim = m.sim
    x = m.way(body)
    out = {
        "velocity": np.diff(x, prepend=x[:1]) / sim.record.dt,
        "position": x,
        TIME: sim.record.t - sim.record.t[0],
    }
    if m.turns(body) and np.ptp(x) > TURNS * 2 * np.pi:
        out["angle"] = np.mod(x, 2 * np.pi)
    if sim.volts.shape[1] and sim.case.problem != "static":  # a static problem predicts the force itself
        out["command"] = sim.volts[:, 0]
    return out


def after(axis: str, values: list[np.ndarray]) -> list[np.ndarray]:
    """Values of an axis in each recording; the times of the recordings follow one another."""
    if axis != TIME:
        return values
    ends = np.cumsum([0.0, *(v[-1] for v in values)])
    return [v + end for v, end in zip(values, ends, strict=False)]
