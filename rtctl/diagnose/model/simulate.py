"""Simulator of a recording: any model of its machine, under the recorded commands and a tracking observer.

track   the recorded command, and a correction that makes the model follow the main sensor. The correction moves
        positions and speeds of all bodies along their rigid motion: it stretches no joint and starts no slip.
open    the recorded command alone: a free run
held    the coordinate of the main sensor moves as recorded. A static problem predicts the force of this motion, a
        kinematic problem the other positions.
"""

from copy import copy
from functools import cached_property

import numpy as np

from rtctl.case.start import HELD_PROBLEMS
from rtctl.diagnose.model import kernel
from rtctl.diagnose.model.kernel import HELD, TRACK
from rtctl.diagnose.model.model import GraphModel, own, rigid
from rtctl.diagnose.model.motion import Path, main_path, paths
from rtctl.diagnose.model.observer import Followed, followed
from rtctl.diagnose.model.prepare import ABSENT, path_of, places, pushing, ready, stiff_ends
from rtctl.diagnose.model.recording import GraphRecord
from rtctl.diagnose.record.edges import Edges, edges
from rtctl.plants.graph.layout import NOWHERE
from rtctl.plants.graph.linearised import ringing
from rtctl.plants.graph.mechanics import code_of
from rtctl.plants.graph.params import build, drive_gain

QUICKEST = 0.25  # rad a tick, largest bandwidth of a correction with a tick of delay
SUBSTEP = 0.5e-3  # s, longest substep; the linear part is exact for any length
SUBSTEPS = 20  # substeps of a slow row, at most
LEAD = 1.0  # s, longest time before the first row for the decay of oscillations
FORGOTTEN = 5.0  # time constants of the slowest decay before the first row
SLOW = 3.0  # time constants of the usual observer: window of the mean of a slow residual
STEADY = 0.4  # rad a substep, of the highest natural frequency where backlash is crossed
NEVER = np.iinfo(np.int64).max  # row of a release that never comes


class Simulator:
    """Recording under which models are simulated; one call is one run, and several threads may call."""

    def __init__(self, record: GraphRecord, follow: float | None = None):
        self.record, self.case = record, record.case
        self.code = code_of(record.case.machine)
        self.kernel = kernel.kernel(self.code)
        self.layout = record.case.layout
        self.elements = places(self.layout)
        self.main = record.main
        sensor = record.case.machine.sensors[self.main]
        self.shows_speed = sensor.measures == "speed"
        self.body = sensor.body
        self.followed = followed(record)
        usual = self.followed[0].bandwidth
        self.quickest = QUICKEST / record.dt  # rad/s
        self.follow = min(usual if follow is None else follow, self.quickest)
        self.substeps = max(1, int(np.ceil(min(record.dt / SUBSTEP, SUBSTEPS) - 1e-9)))
        if self.case.problem == "kinematic" or record.dt > SUBSTEPS * SUBSTEP:
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
        self.begins: tuple[float, float] | None = None  # first position and speed of the main body in a free run
        self.ratios = self.moves(record.case.values)
        self.wrong: dict[str, np.ndarray] = {}  # errors (n,) of readings, SI
        self.edges: dict[str, Edges] = {}  # of sensors without direction, decoded by a model

    @property
    def window(self) -> int:
        """Ticks of the window of slow means."""
        return max(1, round(SLOW / min(self.followed[0].bandwidth, self.follow) / self.record.dt))

    def bandwidth(self, one: Followed) -> float:
        """Bandwidth of the observer of a sensor, rad/s."""
        return self.follow * one.bandwidth / self.followed[0].bandwidth

    def _rest(self) -> float:
        """Time for the decay of oscillations before the first row, s."""
        machine = self.case.machine
        if machine.mechanics is not None or self.case.problem == "free":  # it swings on with held sensors
            return 0.0
        weighs = any(body.weights for body in machine.bodies.values())
        if weighs or not self.layout.links:
            return LEAD if weighs else 0.0
        swings = ringing(build(self.layout, self.case.values, self.record.dt))
        return min(LEAD, FORGOTTEN / max(float(-swings.real.max()), 1e-9)) if len(swings) else LEAD

    def directed(self, model: GraphModel) -> "Simulator":
        """Simulator with the sensors without direction decoded by a model, where its motion decides the directions of
        the edges; the position between two edges is interpolated linearly."""
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
        shown = {*self.channels, *found} - (self.record.edges.keys() - found.keys())
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
        """Motion of each body for one unit of the connected followed body; 0 where there is none."""
        out: dict[str, float] = {}
        for one in self.followed:
            for name, ratio in rigid(self.layout, values, one.body).items():
                out[name] = out.get(name) or ratio
        return out

    def leader(self, body: str) -> int:
        """Number of the followed sensor that joints connect with a body; 0 where there is none."""
        for number, one in enumerate(self.followed):
            if rigid(self.layout, self.case.values, one.body).get(body, 0.0) != 0.0:
                return number
        return 0

    def _ring(self) -> float:
        """Highest natural frequency of a body on a joint, rad/s, without the held body."""
        p = GraphModel(self.layout, self.case.values).params(SUBSTEP)
        held, out = self.layout.coordinate(str(self.body)), 0.0
        for at, stiffness in stiff_ends(p):
            if at != held:
                out = max(out, float(np.sqrt(stiffness / p.inertia[at])))
        return out

    @cached_property
    def pace(self) -> float:
        """Rms speed of the followed body, rad/s or m/s; of a speed sensor its standard deviation."""
        x = self.seen
        return float(np.std(x) if self.shows_speed else np.sqrt(np.mean(np.gradient(x, self.record.dt) ** 2)))

    def column(self, channel: str) -> int:
        """Column of a channel in the readings of a run; the last column is the force of the drives."""
        return self.layout.sensors.get(channel, len(self.layout.sensors))

    def own(self, model: GraphModel) -> GraphModel:
        """Model with the numbers of this recording."""
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

    def following(self, times: float) -> "Simulator":
        """Simulator with `times` the bandwidth of the observer, up to the limit of the tick."""
        other = copy(self)
        other.follow = min(times * self.follow, self.quickest)
        return other

    def usual(self) -> "Simulator":
        """Simulator with an observer of the usual bandwidth."""
        return self.following(self.followed[0].bandwidth / self.follow)

    def released(self, row: int) -> "Simulator":
        """Simulator whose correction ends at `row`: a free run from `row` on, from the state of the observer."""
        other = copy(self)
        other.release = row
        return other

    def beginning(self, position: float, speed: float) -> "Simulator":
        """Simulator whose main body begins at a position, as its column shows it, and at a speed, SI."""
        other = copy(self)
        other.begins = (position, speed)
        return other

    def pushed(self, forces: np.ndarray) -> "Simulator":
        """Simulator with forces (n, coordinates), N or Nm, added to the measured forces."""
        other = copy(self)
        other.forces = np.ascontiguousarray(forces if len(self.forces) < 2 else self.forces + forces)
        return other

    def misread(self, sensor: str, error: np.ndarray) -> "Simulator":
        """Simulator whose sensor has a reading error (n,), SI. Its observer follows the reading without the error."""
        other = copy(self)
        other.wrong = {sensor: error}
        shown = [one.sensor == sensor for one in self.followed]
        other.watched = self.watched - np.outer(error, shown)
        return other

    def seen_by(self, model: GraphModel) -> "Simulator":
        """Simulator whose followed sensors show the readings of a model under the observer."""
        other = copy(self)
        if self.mode == TRACK:
            out = self.run(self.own(model))[:, [self.layout.sensors[one.sensor] for one in self.followed]]
            other.watched = np.where(np.isfinite(out), out, self.watched)
        return other

    def finer(self, times: int) -> "Simulator":
        """Simulator with `times` as many substeps."""
        other = copy(self)
        other.substeps *= times
        return other

    def run(self, model: GraphModel, mode: int | None = None, n: int | None = None, coarse: bool = False) -> np.ndarray:
        """Readings (n, sensors of the machine), SI, and in a last column the force of the drives of a static problem.

        Readings are nan from the tick on at which the model diverged. For None the mode is that of the problem.

        `coarse` takes longer substeps: accurate enough for differences, not for verdicts.
        """
        return self.everything(model, mode, n, coarse)[0]

    def everything(
        self, model: GraphModel, mode: int | None = None, n: int | None = None, coarse: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Readings (n, sensors), SI, and corrections (n, followed), N or Nm at the body of each followed sensor."""
        record, start = self.record, ready(self, model, mode, coarse)
        model, job, offsets = start.model, start.job, start.offsets
        n = len(self.seen) if n is None else n
        seen = np.ascontiguousarray(self.watched[:n] + offsets)
        path, pace = path_of(self, job, model, float(offsets[0]))
        out, push = np.full((n, start.params.ny), np.nan), np.zeros((n, len(self.followed)))
        static = self.case.problem == "static"  # measured forces replace the commands
        done = self.kernel.module.run(
            job, start.p, start.states, start.slots, (np.zeros_like if static else np.asarray)(self.volts[:n]),
            pushing(self, model)[:n], seen, path[:n], pace[:n], out, push,
        )  # fmt: skip
        out[max(done, 0) :] = np.nan
        self.counted(out, offsets)
        for name, error in self.wrong.items():
            out[:, self.layout.sensors[name]] += error[:n]
        if static:  # required force of the drives, by their nominal gain
            name = next((c for c in self.channels if c not in self.layout.sensors), "")
            made, share = (record.y[name][:n], self._told(name, model)) if name else (np.zeros(n), 1.0)
            out = np.column_stack([out, push[:, 0] * share])
            push[:, 0] -= made / share
        return out, push

    def counted(self, out: np.ndarray, offsets: np.ndarray) -> None:
        """Shift the readings (n, sensors) of followed sensors to the zero of their columns."""
        for one, offset in zip(self.followed, offsets, strict=True):
            if offset:
                out[:, self.layout.sensors[one.sensor]] -= offset

    def _told(self, drive: str, model: GraphModel) -> float:
        """Nominal gain of a drive over its gain in the model."""
        return drive_gain(self.case.values, drive) / drive_gain(model.base, drive)
