"""Simulator of a recording: any model of its machine, under the recorded commands and a tracking observer.

track   the recorded command, and a correction that makes the model follow the main sensor. It pushes every body as
        its inertia asks for, so that the rigid motion is corrected and no joint is stretched by the correction.
open    the recorded command alone: a free run
"""

from copy import copy
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.diagnose.graph import kernel
from rtctl.diagnose.graph.case import BEGINS, START
from rtctl.diagnose.graph.kernel import TRACK
from rtctl.diagnose.graph.model import GraphModel, rigid
from rtctl.diagnose.graph.record import GraphRecord
from rtctl.diagnose.kernel import SLOTS
from rtctl.idiom import fill_record, record_dtype
from rtctl.plants.graph.elements import elements, spot
from rtctl.plants.graph.layout import NOWHERE
from rtctl.plants.graph.mechanics import code_of
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics import TERMS, ordered

FOLLOW = 30.0  # rad/s, bandwidth of the observer of a position
FOLLOW_SPEED = 5.0  # rad/s, of a speed: it does not drift, and has more noise to average
QUICKEST = 0.25  # rad a tick: a correction that comes a tick late may not be quicker
SUBSTEP = 0.5e-3  # s, at most: the linear part is exact at any
LEAD = 0.5  # s at the first row, in which springs come to rest
NEVER = np.iinfo(np.int64).max  # row
ABSENT = np.zeros((1, 1))


class Followed(NamedTuple):
    """A sensor that the model is made to follow."""

    sensor: str
    body: str
    shows_speed: bool

    @property
    def bandwidth(self) -> float:
        """Usual bandwidth of its observer, rad/s."""
        return FOLLOW_SPEED if self.shows_speed else FOLLOW


class Simulator:
    """A recording, ready to be simulated by models; one call is one run, and calls may go on in several threads."""

    def __init__(self, record: GraphRecord, follow: float | None = None):
        self.record, self.case = record, record.case
        self.kernel = kernel.kernel(code_of(record.case.machine))
        self.layout = record.case.layout
        self.elements = elements(self.layout)
        self.main = record.main
        sensor = record.case.machine.sensors[self.main]
        self.shows_speed = sensor.measures == "speed"
        self.body = sensor.body
        self.followed = followed(record)
        usual = self.followed[0].bandwidth
        self.follow = min(usual if follow is None else follow, QUICKEST / record.dt)
        self.substeps = max(1, int(np.ceil(record.dt / SUBSTEP - 1e-9)))
        self.watched = np.stack([record.y[one.sensor] for one in self.followed], axis=1)
        self.volts = np.ascontiguousarray(record.u)
        self.forces = self._forces(record.forces)
        self.channels = [name for name in self.layout.sensors if name in record.y]
        machine = record.case.machine
        flexible = bool(self.layout.links) or any(b.weights for b in machine.bodies.values())
        flexible = flexible and machine.mechanics is None  # which swings on while its sensors are held
        self.lead = round(LEAD / record.dt) if flexible else 0
        self.release = NEVER
        self.ratios = self.moves(record.case.values)

    @property
    def seen(self) -> np.ndarray:
        """Main sensor (n,), SI."""
        return np.asarray(self.watched[:, 0])

    @seen.setter
    def seen(self, values: np.ndarray) -> None:
        self.watched = np.column_stack([values, self.watched[:, 1:]])

    def moves(self, values: dict[str, float]) -> dict[str, float]:
        """Motion of each body for one unit of the followed body that joints connect it with; 0 where there is none."""
        out: dict[str, float] = {}
        for one in self.followed:
            for name, ratio in rigid(self.layout, values, one.body).items():
                out[name] = out.get(name) or ratio
        return out

    def leader(self, body: str) -> int:
        """Number of the followed sensor with which joints connect a body; 0 where there is none."""
        for number, one in enumerate(self.followed):
            if rigid(self.layout, self.case.values, one.body).get(body, 0.0) != 0.0:
                return number
        return 0

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
        """Readings, and the corrections (n, followed), in N or Nm at the body of each followed sensor."""
        record, k = self.record, self.kernel
        model = model.built()
        n = len(self.seen) if n is None else n
        stiff = any(TERMS[str(getattr(t, "term", ""))].stiff for t in model.terms)
        substeps = self.substeps * (2 if stiff else 1)
        substeps = (substeps + 1) // 2 if coarse else substeps
        h = record.dt / substeps
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
        job = self._job(model, params, mode, substeps)
        states = np.zeros(1, GRAPH_STATE)
        offsets = np.array([start_of(self, one, model.base) for one in self.followed])
        seen = np.ascontiguousarray(self.watched[:n] + offsets)
        self._begin(states, model, seen[0])
        out, push = np.full((n, params.ny), np.nan), np.zeros((n, len(self.followed)))
        done = k.module.run(
            job, p, states, slots, self.volts[:n], self._pushing(model)[:n],
            seen, out, push,
        )  # fmt: skip
        out[max(done, 0) :] = np.nan
        for one, offset in zip(self.followed, offsets, strict=True):
            if offset:
                out[:, self.layout.sensors[one.sensor]] -= offset
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

    def _begin(self, states: np.ndarray, model: GraphModel, first: np.ndarray) -> None:
        """Put every coordinate where the first row of the followed sensors has it, the joints unstretched."""
        x = states["m"]["x"][0]
        mechanics = self.case.machine.mechanics
        for name, place in (mechanics.at if mechanics is not None else {}).items():
            x[model.layout.coordinate(name)] = place / model.layout.ratio(name, model.base)
        for number in range(len(self.followed) - 1, -1, -1):
            one = self.followed[number]
            for name, ratio in rigid(self.layout, self.case.values, one.body).items():
                if ratio == 0.0:
                    continue
                value = ratio * first[number] / model.layout.ratio(name, model.base)
                at = model.layout.coordinate(name)
                if one.shows_speed:
                    x[model.layout.nq + at] = value
                    states["m"]["v_before"][0, at] = value
                else:
                    x[at] = value

    def _job(self, model: GraphModel, params: Any, mode: int, substeps: int) -> np.ndarray:
        job = np.zeros(1, kernel.JOB)
        j = job[0]
        dt = self.record.dt
        j["mode"], j["substeps"], j["rate"], j["release"] = mode, substeps, 1.0 / dt, self.release
        j["lead"] = self.lead if mode == TRACK else 0
        j["part"], j["delay"] = np.modf(self.case.delay_samples * substeps)
        j["follows"] = len(self.followed)
        for number, one in enumerate(self.followed):
            j["main"][number], j["speed"][number] = model.layout.sensors[one.sensor], one.shows_speed
            inertia = 0.0
            push = np.zeros(j["push"].shape[1])
            for name, ratio in rigid(self.layout, self.case.values, one.body).items():
                at, own = model.layout.coordinate(name), model.layout.ratio(name, model.base)
                if ratio != 0.0:
                    push[at] = params.inertia[at] * ratio / own
            for at in range(model.layout.nq):
                inertia += push[at] ** 2 / params.inertia[at]
            j["push"][number] = push / inertia  # a unit of correction is a unit of force at the followed body
            follow = self.follow * one.bandwidth / self.followed[0].bandwidth
            j["P"][number], j["D"][number] = follow**2 * inertia, 1.4 * follow * inertia
            j["a"][number] = -np.expm1(-10.0 * follow * dt)
        return job


def followed(record: GraphRecord) -> tuple[Followed, ...]:
    """Sensors that the observer follows: the main one, and of each body that joints do not connect with one of them."""
    case = record.case
    sensors = case.machine.sensors
    order = [record.main, *(n for wanted in ("position", "speed") for n, s in sensors.items() if s.measures == wanted)]
    out: list[Followed] = []
    reached: set[str] = set()
    for name in order:
        body = str(sensors[name].body)
        if name not in record.y or body in reached or (out and sensors[name].body is None):
            continue
        out.append(Followed(name, body, sensors[name].measures == "speed"))
        reached |= {other for other, ratio in rigid(case.layout, case.values, body).items() if ratio != 0.0}
    return tuple(out)


def start_of(sim: Simulator, one: Followed, base: dict[str, float]) -> float:
    """Position of a followed body where its column shows 0, rad or m."""
    machine = sim.case.machine
    first = base.get(START, 1.0) if one.sensor == sim.main else 1.0
    offset = float(np.log(first * base.get(f"{BEGINS}.{one.body}", 1.0)))
    if machine.mechanics is not None and not one.shows_speed:
        offset += machine.mechanics.at.get(one.body, 0.0)
    return offset


_dtypes: dict[type, np.dtype] = {}


def _dtype(params: Any) -> np.dtype:
    return _dtypes.setdefault(type(params), record_dtype(params))
