"""Simulator of a recording: any model of its machine, under the recorded commands and a tracking observer.

track   the recorded command, and a correction that makes the model follow the main sensor. It pushes every body as
        its inertia asks for, so that the rigid motion is corrected and no joint is stretched by the correction.
open    the recorded command alone: a free run
"""

from copy import copy
from typing import Any

import numpy as np

from rtctl.config.errors import UserError
from rtctl.diagnose.edges import Edges, edges
from rtctl.diagnose.graph import kernel
from rtctl.diagnose.graph.case import START
from rtctl.diagnose.graph.kernel import TRACK
from rtctl.diagnose.graph.model import GraphModel, rigid
from rtctl.diagnose.graph.record import GraphRecord
from rtctl.diagnose.kernel import SLOTS
from rtctl.idiom import fill_record, record_dtype
from rtctl.plants.graph.elements import elements, spot
from rtctl.plants.graph.layout import NOWHERE
from rtctl.plants.graph.params import build
from rtctl.plants.graph.plant import GRAPH_STATE, state_space
from rtctl.plants.physics import TERMS, ordered

FOLLOW = 30.0  # rad/s, bandwidth of the observer of a position
FOLLOW_SPEED = 5.0  # rad/s, of a speed: it does not drift, and has more noise to average
QUICKEST = 0.25  # rad a tick: a correction that comes a tick late may not be quicker
COARSEST = 0.25e-3  # s, of substeps that are longer than a tick, at most
SUBSTEP = 0.5e-3  # s, at most: the linear part is exact at any
LEAD = 1.0  # s at the first row, at most, in which springs come to rest
FORGOTTEN = 5.0  # time constants of what swings longest, after which it does so no more
NEVER = np.iinfo(np.int64).max  # row
ABSENT = np.zeros((1, 1))


class Simulator:
    """A recording, ready to be simulated by models; one call is one run, and calls may go on in several threads."""

    def __init__(self, record: GraphRecord, follow: float | None = None):
        self.record, self.case = record, record.case
        self.kernel = kernel.kernel()
        self.layout = record.case.layout
        self.elements = elements(self.layout)
        self.main = record.main
        sensor = record.case.machine.sensors[self.main]
        self.shows_speed = sensor.measures == "speed"
        self.body = sensor.body
        usual = FOLLOW_SPEED if self.shows_speed else FOLLOW
        self.follow = min(usual if follow is None else follow, QUICKEST / record.dt)
        self.substeps = max(1, int(np.ceil(record.dt / SUBSTEP - 1e-9)))
        self.seen = np.ascontiguousarray(record.y[self.main])
        self.volts = np.ascontiguousarray(record.u)
        self.forces = self._forces(record.forces)
        self.channels = [name for name in self.layout.sensors if name in record.y]
        self.lead = round(self._rest() / record.dt)
        self.release = NEVER
        self.ratios = rigid(self.layout, record.case.values, str(self.body))
        self.edges: dict[str, Edges] = {}  # of sensors without direction, by the direction that a model gives them

    def _rest(self) -> float:
        """Time in s at the first row in which what swings comes to rest."""
        weighs = any(body.weights for body in self.case.machine.bodies.values())
        if weighs or not self.layout.links:
            return LEAD if weighs else 0.0
        poles = np.linalg.eigvals(state_space(build(self.layout, self.case.values, self.record.dt))[0])
        swings = poles[np.abs(poles.imag) > 1e-3 * np.abs(poles)]
        return min(LEAD, FORGOTTEN / max(float(-swings.real.max()), 1e-9)) if len(swings) else LEAD

    def directed(self, model: GraphModel) -> "Simulator":
        """The same with the sensors that know no direction as the model tells the directions of their edges, where it
        does: between two edges they are on a line."""
        found: dict[str, Edges] = {}
        y, grain = dict(self.record.y), dict(self.record.grain)
        out = self.run(model) if self.record.edges else np.empty((0, 0))
        for name, counts in self.record.edges.items():
            y.pop(name, None)
            scale, c, main = (
                self.case.machine.sensors[name].scale,
                self.layout.sensors[name],
                self.layout.sensors[self.main],
            )
            gear = float(np.polyfit(out[:, main], out[:, c], 1)[0]) if np.isfinite(out).all() else np.nan
            told = edges(counts, scale * (out[:, c] + gear * (self.seen - out[:, main])), c)
            if told is not None:
                found[name] = told
                ticks = told.rows - 1 + told.share
                y[name] = np.interp(np.arange(len(counts)), ticks, told.at / scale)
                grain[name] = 1.0 / abs(scale)
        other = copy(self)
        other.record, other.edges = self.record._replace(y=y, grain=grain), found
        other.channels = [name for name in self.layout.sensors if name in y]
        return other

    def _forces(self, by_body: np.ndarray | None) -> np.ndarray:
        if by_body is None:
            return ABSENT
        out = np.zeros((len(by_body), self.layout.nq))
        for i, name in enumerate(self.case.machine.bodies):
            place = self.layout.bodies[name]
            if place.coordinate != NOWHERE:
                out[:, place.coordinate] += self.layout.ratio(name, self.case.values) * by_body[:, i]
        return out

    def released(self, row: int) -> "Simulator":
        """The same whose correction ends at `row`: a free run from there, from the state that the observer reached."""
        other = copy(self)
        other.release = row
        return other

    def pushed(self, forces: np.ndarray) -> "Simulator":
        """The same with forces (n, coordinates) on top of the measured ones."""
        other = copy(self)
        other.forces = np.ascontiguousarray(forces if len(self.forces) < 2 else self.forces + forces)
        return other

    def finer(self, times: int) -> "Simulator":
        """The same with steps that are so many `times` shorter."""
        other = copy(self)
        other.substeps *= times
        return other

    def run(self, model: GraphModel, mode: int = TRACK, n: int | None = None, coarse: bool = False) -> np.ndarray:
        """Readings (n, sensors of the machine) in SI; nan from the tick on at which the model ran away.

        `coarse` takes steps of twice the length: good for differences, not for verdicts.
        """
        return self.everything(model, mode, n, coarse)[0]

    def everything(
        self, model: GraphModel, mode: int = TRACK, n: int | None = None, coarse: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Readings, and the correction (n,), in N or Nm at the main sensor's body."""
        record, k = self.record, self.kernel
        model = model.built()
        n = len(self.seen) if n is None else n
        stiff = any(TERMS[str(getattr(t, "term", ""))].stiff for t in model.terms)
        substeps = self.substeps * (2 if stiff else 1)
        coarse = coarse and not any(TERMS[str(getattr(t, "term", ""))].slips for t in model.terms)  # a matter of ticks
        stride = max(1, int(COARSEST / record.dt)) if coarse and self.substeps == 1 else 1
        substeps = 1 if stride > 1 else (substeps + 1) // 2 if coarse else substeps
        h = record.dt * stride / substeps
        params = model.params(h)
        p = np.zeros(1, _dtype(params))
        fill_record(p[0], params)
        if len(model.terms) > SLOTS:
            raise UserError(f"physics: has {len(model.terms)} terms; {SLOTS} is the most that can be simulated")
        slots = np.zeros(1, k.slots)
        acting = [t for t in ordered(list(model.terms)) if TERMS[str(getattr(t, "term", ""))].joint is None]
        there = self.elements if model.layout is self.layout else elements(model.layout)
        for slot, settings in zip(slots[0]["q"], acting, strict=False):
            s: Any = settings
            kernel.fill_slot(k, slot, s, spot(TERMS[s.term], s.node, model.layout, there, model.base), h)
        job = self._job(model, params, mode, substeps, stride)
        states = np.zeros(1, GRAPH_STATE)
        start = float(np.log(model.base.get(START, 1.0)))
        seen = self.seen[:n] + start if start else self.seen[:n]
        self._begin(states, model, float(seen[0]))
        out, push = np.full((n, params.ny), np.nan), np.zeros(n)
        done = k.module.run(
            job, p, states, slots, self.volts[:n], self._pushing(model)[:n],
            seen, out, push,
        )  # fmt: skip
        out[max(done, 0) :] = np.nan
        if start:
            out[:, self.layout.sensors[self.main]] -= start
        return out, push

    def _pushing(self, model: GraphModel) -> np.ndarray:
        """Forces by the coordinates of a model that may have more of them than the description."""
        if len(self.forces) < 2 or model.layout is self.layout:
            return self.forces
        out = np.zeros((len(self.forces), model.layout.nq))
        first: dict[int, str] = {}
        for name, body in self.layout.bodies.items():
            first.setdefault(body.coordinate, name)
        for at, name in first.items():
            if at != NOWHERE:
                out[:, model.layout.coordinate(name)] += self.forces[:, at]
        return out

    def _begin(self, states: np.ndarray, model: GraphModel, first: float) -> None:
        """Put every coordinate where the first row of the main sensor has it, the joints unstretched."""
        x = states["m"]["x"][0]
        for name, ratio in self.ratios.items():
            own = model.layout.ratio(name, model.base)
            value = ratio * first / own
            at = model.layout.coordinate(name)
            if self.shows_speed:
                x[model.layout.nq + at] = value
                states["m"]["v_before"][0, at] = value
            else:
                x[at] = value

    def _job(self, model: GraphModel, params: Any, mode: int, substeps: int, stride: int) -> np.ndarray:
        job = np.zeros(1, kernel.JOB)
        j = job[0]
        dt = self.record.dt * stride
        j["stride"] = stride
        j["mode"], j["substeps"], j["rate"], j["release"] = mode, substeps, 1.0 / dt, self.release
        j["lead"] = self.lead if mode == TRACK else 0
        j["part"], j["delay"] = np.modf(self.case.delay_samples * substeps)
        j["main"], j["speed"] = model.layout.sensors[self.main], self.shows_speed
        inertia = 0.0
        push = np.zeros(len(j["push"]))
        for name, ratio in self.ratios.items():
            at, own = model.layout.coordinate(name), model.layout.ratio(name, model.base)
            push[at] = params.inertia[at] * ratio / own
        for at in range(model.layout.nq):
            inertia += push[at] ** 2 / params.inertia[at]
        j["push"] = push / inertia  # a unit of correction is a unit of force at the main body
        j["P"], j["D"] = self.follow**2 * inertia, 1.4 * self.follow * inertia
        j["a"] = -np.expm1(-10.0 * self.follow * dt)
        return job


_dtypes: dict[type, np.dtype] = {}


def _dtype(params: Any) -> np.dtype:
    return _dtypes.setdefault(type(params), record_dtype(params))
