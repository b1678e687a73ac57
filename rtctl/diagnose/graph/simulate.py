"""Simulator of a recording: any model of its machine, under the recorded commands and a tracking observer.

track   the recorded command, and a correction that makes the model follow the main sensor. It pushes every body as
        its inertia asks for, so that the rigid motion is corrected and no joint is stretched by the correction.
open    the recorded command alone: a free run
held    the main sensor's coordinate moves as it was recorded, and the force that it takes is what the model predicts:
        of a static problem, where forces were measured, and of a kinematic one, where other positions follow
"""

from copy import copy
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rtctl.config.errors import UserError
from rtctl.diagnose.edges import Edges, edges
from rtctl.diagnose.graph import kernel
from rtctl.diagnose.graph.case import BEGINS, FIRST_POSITION, FIRST_SPEED, HELD_PROBLEMS, OWN_START, START
from rtctl.diagnose.graph.kernel import HELD, TRACK
from rtctl.diagnose.graph.model import GraphModel, carried, moved_inertia, own, rigid
from rtctl.diagnose.graph.motion import Path, main_path, paths
from rtctl.diagnose.graph.record import GraphRecord
from rtctl.diagnose.kernel import SLOTS
from rtctl.idiom import fill_record, record_dtype
from rtctl.plants.graph.elements import elements, spot
from rtctl.plants.graph.layout import NOWHERE
from rtctl.plants.graph.linearised import ringing
from rtctl.plants.graph.mechanics import code_of
from rtctl.plants.graph.params import build, drive_gain
from rtctl.plants.graph.plant import GRAPH_STATE
from rtctl.plants.physics import TERMS, ordered

FOLLOW = 30.0  # rad/s, bandwidth of the observer of a position
FOLLOW_SPEED = 5.0  # rad/s, of a speed: it does not drift, and has more noise to average
QUICKEST = 0.25  # rad a tick: a correction that comes a tick late may not be quicker
COARSEST = 0.25e-3  # s, of substeps that are longer than a tick, at most
SUBSTEP = 0.5e-3  # s, at most: the linear part is exact at any
LEAD = 1.0  # s at the first row, at most, in which springs come to rest
FORGOTTEN = 5.0  # time constants of what swings longest, after which it does so no more
STEADY = 0.4  # rad a substep, of the quickest ring in which lost motion is crossed
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


class Ready(NamedTuple):
    """A model at the first row of a recording."""

    model: GraphModel  # with the numbers of the recording
    params: Any
    job: np.ndarray
    p: np.ndarray
    states: np.ndarray
    slots: np.ndarray
    offsets: np.ndarray  # (followed,) positions where their columns show 0, rad or m


class Simulator:
    """A recording, ready to be simulated by models; one call is one run, and calls may go on in several threads."""

    def __init__(self, record: GraphRecord, follow: float | None = None):
        self.record, self.case = record, record.case
        self.code = code_of(record.case.machine)
        self.kernel = kernel.kernel(self.code)
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
        if self.case.problem == "kinematic":
            self.substeps = max(self.substeps, int(np.ceil(record.dt * self._ring() / STEADY)))
        self.watched = np.stack([record.y[one.sensor] for one in self.followed], axis=1)
        self.volts = np.ascontiguousarray(record.u)
        self.forces = self._forces(record.forces)
        self.mode = HELD if self.case.problem in HELD_PROBLEMS else TRACK
        self.held: Path | None = main_path(record) if self.mode == HELD else None
        self.inputs = paths(record)
        self.channels = [n for n in (*self.layout.sensors, *self.case.machine.drives) if n in record.y]
        if self.mode == HELD:
            self.channels.remove(self.main)
        self.lead = round(self._rest() / record.dt)
        self.release = NEVER
        self.ratios = self.moves(record.case.values)
        self.edges: dict[str, Edges] = {}  # of sensors without direction, by the direction that a model gives them

    def _rest(self) -> float:
        """Time in s at the first row in which what swings comes to rest."""
        machine = self.case.machine
        if machine.mechanics is not None or self.case.problem == "free":  # it swings on while its sensors are held
            return 0.0
        weighs = any(body.weights for body in machine.bodies.values())
        if weighs or not self.layout.links:
            return LEAD if weighs else 0.0
        swings = ringing(build(self.layout, self.case.values, self.record.dt))
        return min(LEAD, FORGOTTEN / max(float(-swings.real.max()), 1e-9)) if len(swings) else LEAD

    def directed(self, model: GraphModel) -> "Simulator":
        """The same with the sensors that know no direction as the model tells the directions of their edges, where it
        does: between two edges they are on a line."""
        found: dict[str, Edges] = {}
        y, grain = dict(self.record.y), dict(self.record.grain)
        out = self.run(model) if self.record.edges else np.empty((0, 0))
        for name, counts in self.record.edges.items():
            y.pop(name, None)
            scale = self.case.machine.sensors[name].scale
            c, main = self.layout.sensors[name], self.layout.sensors[self.main]
            gear = float(np.polyfit(out[:, main], out[:, c], 1)[0]) if np.isfinite(out).all() else np.nan
            told = edges(counts, scale * (out[:, c] + gear * (self.seen - out[:, main])), c)
            if told is not None:
                found[name] = told
                ticks = told.rows - 1 + told.share
                y[name] = np.interp(np.arange(len(counts)), ticks, told.at / scale)
                grain[name] = 1.0 / abs(scale)
        other = copy(self)
        other.record, other.edges = self.record._replace(y=y, grain=grain), found
        shown = {*self.channels, *found}
        other.channels = [name for name in (*self.layout.sensors, *self.case.machine.drives) if name in shown]
        return other

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

    def _ring(self) -> float:
        """Highest frequency, rad/s, at which a body beside the held one rings with a joint."""
        p = GraphModel(self.layout, self.case.values).params(SUBSTEP)
        held, out = self.layout.coordinate(str(self.body)), 0.0
        for at, stiffness in stiff_ends(p):
            if at != held:
                out = max(out, float(np.sqrt(stiffness / p.inertia[at])))
        return out

    @cached_property
    def pace(self) -> float:
        """Rms speed of the followed body, rad/s or m/s; of a speed its spread."""
        x = self.seen
        return float(np.std(x) if self.shows_speed else np.sqrt(np.mean(np.gradient(x, self.record.dt) ** 2)))

    def _own_scales(self, params: Any, at: int) -> tuple[float, float]:
        """Scales of the first position and speed of a coordinate: those of a ring as quick as the machine moves."""
        ratio = next((r / self.layout.ratio(name, self.case.values) for name, r in self.ratios.items()
                      if r and self.layout.coordinate(name) == at), 1.0)  # fmt: skip
        stiffness = sum(c for end, c in stiff_ends(params) if end == at)
        speed = self.pace * abs(ratio)
        return speed * float(np.sqrt(params.inertia[at] / stiffness)) if stiffness else 0.0, speed

    def column(self, channel: str) -> int:
        """Column of a channel in what a run returns: that of its sensor, the last one for the force of the drives."""
        return self.layout.sensors.get(channel, len(self.layout.sensors))

    def own(self, model: GraphModel) -> GraphModel:
        """The model with the numbers of this recording."""
        gauged = model.layout.sensors.keys() != self.layout.sensors.keys()
        layout = model.layout if gauged else self.layout
        return model._replace(base=own(model.base, self.record.name), layout=layout)

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

    def run(self, model: GraphModel, mode: int | None = None, n: int | None = None, coarse: bool = False) -> np.ndarray:
        """Readings (n, sensors of the machine) in SI, with the force of the drives after them where it was measured;
        nan from the tick on at which the model ran away. The mode is that of the problem where none is given.

        `coarse` takes steps of twice the length: good for differences, not for verdicts.
        """
        return self.everything(model, mode, n, coarse)[0]

    def everything(
        self, model: GraphModel, mode: int | None = None, n: int | None = None, coarse: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Readings, and the corrections (n, followed), in N or Nm at the body of each followed sensor."""
        record, ready = self.record, self.ready(model, mode, coarse)
        model, job, offsets = ready.model, ready.job, ready.offsets
        n = len(self.seen) if n is None else n
        seen = np.ascontiguousarray(self.watched[:n] + offsets)
        path, pace = self.path_of(job, model, ready.params, float(offsets[0]))
        out, push = np.full((n, ready.params.ny), np.nan), np.zeros((n, len(self.followed)))
        static = self.case.problem == "static"  # forces were measured: the commands that made them do not count
        done = self.kernel.module.run(
            job, ready.p, ready.states, ready.slots, (np.zeros_like if static else np.asarray)(self.volts[:n]),
            self.pushing(model)[:n], seen, path[:n], pace[:n], out, push,
        )  # fmt: skip
        out[max(done, 0) :] = np.nan
        self.counted(out, offsets)
        if static:  # what the drives would have to make, as their nominal gain tells it
            name = next((c for c in self.channels if c not in self.layout.sensors), "")
            made, share = (record.y[name][:n], self._told(name, model)) if name else (np.zeros(n), 1.0)
            out = np.column_stack([out, push[:, 0] * share])
            push[:, 0] -= made / share
        return out, push

    def counted(self, out: np.ndarray, offsets: np.ndarray) -> None:
        """Let the readings (n, sensors) of followed sensors count from where their columns show 0."""
        for one, offset in zip(self.followed, offsets, strict=True):
            if offset:
                out[:, self.layout.sensors[one.sensor]] -= offset

    def ready(self, model: GraphModel, mode: int | None = None, coarse: bool = False) -> "Ready":
        """The records that one run of a model takes, at the first row. Raises UserError for too many terms."""
        record, k = self.record, self.kernel
        mode = self.mode if mode is None else mode
        model = self.own(model).resolved().built()
        stiff = any(TERMS[str(getattr(t, "term", ""))].stiff for t in model.terms)
        substeps = self.substeps * (2 if stiff else 1)
        coarse = coarse and not any(TERMS[str(getattr(t, "term", ""))].slips for t in model.terms)  # a matter of ticks
        whole = self.mode == HELD or bool(self.inputs) or self.case.machine.mechanics is not None  # needs every tick
        stride = max(1, int(COARSEST / record.dt)) if coarse and self.substeps == 1 and not whole else 1
        substeps = 1 if stride > 1 else (substeps + 1) // 2 if coarse else substeps
        h = record.dt * stride / substeps
        params = model.params(h)
        p = np.zeros(1, _dtype(params))
        fill_record(p[0], params)
        if len(model.terms) > SLOTS:
            raise UserError(f"physics: has {len(model.terms)} terms; {SLOTS} is the most that can be simulated")
        slots = np.zeros(1, k.slots)
        acting = [t for t in ordered(list(model.terms)) if TERMS[str(getattr(t, "term", ""))].act]
        there = self.elements if model.layout is self.layout else elements(model.layout)
        for slot, settings in zip(slots[0]["q"], acting, strict=False):
            s: Any = settings
            kernel.fill_slot(k, slot, s, spot(TERMS[s.term], s, model.layout, there, model.base), h)
        job = self._job(model, params, mode, substeps, stride)
        states = np.zeros(1, GRAPH_STATE)
        offsets = np.array([start_of(self, one, model.base) for one in self.followed])
        self._begin(states, model, self.watched[0] + offsets)
        return Ready(model, params, job, p, states, slots, offsets)

    def _told(self, drive: str, model: GraphModel) -> float:
        """Force of a drive by its nominal gain over that by the model's."""
        return drive_gain(self.case.values, drive) / drive_gain(model.base, drive)

    def path_of(self, job: np.ndarray, model: GraphModel, params: Any, start: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions and speeds (n, coordinates) of what moves as recorded; the job is told which."""
        moved = list(self.inputs)
        if job["mode"][0] == HELD:
            assert self.held is not None
            moved.append(self.held._replace(x=self.held.x + start) if start else self.held)
        if not moved:
            return ABSENT, ABSENT
        path, pace = np.zeros((2, len(self.seen), model.layout.nq))
        job["holds"] = 1
        for one in moved:
            at, ratio = model.layout.coordinate(one.body), model.layout.ratio(one.body, model.base)
            path[:, at], pace[:, at] = one.x / ratio, one.v / ratio
            job["held"][0, at] = 1
            job["share"][0, at] = 1.0 / ratio if one is moved[-1] else 0.0
        return path, pace

    def pushing(self, model: GraphModel) -> np.ndarray:
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
        first, rate = first.copy(), 0.0
        if self.case.problem == "free":
            first[0] += self.record.scales[0] * float(np.log(model.base[FIRST_POSITION]))
            rate = self.record.scales[2] + self.record.scales[1] * float(np.log(model.base[FIRST_SPEED]))
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
                if rate and number == 0:
                    speed = ratio * rate / model.layout.ratio(name, model.base)
                    x[model.layout.nq + at] = states["m"]["v_before"][0, at] = speed

    def _job(self, model: GraphModel, params: Any, mode: int, substeps: int, stride: int) -> np.ndarray:
        job = np.zeros(1, kernel.JOB)
        j = job[0]
        dt = self.record.dt * stride
        j["stride"] = stride
        j["mode"], j["substeps"], j["rate"], j["release"] = mode, substeps, 1.0 / dt, self.release
        j["lead"] = self.lead if mode == TRACK else 0
        j["part"], j["delay"] = np.modf(self.case.delay_samples * substeps)
        j["follows"] = len(self.followed)
        for number, one in enumerate(self.followed):
            j["main"][number], j["speed"][number] = model.layout.sensors[one.sensor], one.shows_speed
            moved = carried(model.layout, model.base, rigid(self.layout, self.case.values, one.body))
            inertia = moved_inertia(params.inertia, moved)
            for at, ratio in moved.items():  # a unit of correction is a unit of force at the followed body
                j["push"][number, at] = params.inertia[at] * ratio / inertia
            follow = self.follow * one.bandwidth / self.followed[0].bandwidth
            j["P"][number], j["D"][number] = follow**2 * inertia, 1.4 * follow * inertia
            j["a"][number] = -np.expm1(-10.0 * follow * dt)
        for path, value in model.base.items():
            if path.startswith(OWN_START):
                name, what = path.removeprefix(OWN_START).rsplit(".", 1)
                at, column = model.layout.coordinate(name), ("position", "speed").index(what)
                j[("first_x", "first_v")[column]][at] = self._own_scales(params, at)[column] * float(np.log(value))
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


def stiff_ends(params: Any) -> list[tuple[int, float]]:
    """Coordinate and stiffness at it, N/m or Nm/rad, of each end of each spring."""
    return [
        (int(at), float(params.link_c[k] * lever**2))
        for k in range(params.nl)
        for at, lever in ((params.link_i[k], params.link_a[k]), (params.link_j[k], params.link_b[k]))
    ]


_dtypes: dict[type, np.dtype] = {}


def _dtype(params: Any) -> np.dtype:
    return _dtypes.setdefault(type(params), record_dtype(params))
