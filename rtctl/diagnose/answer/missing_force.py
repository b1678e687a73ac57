"""Missing force or reading of a model of a described machine, along the axis of an effect.

The missing force is the correction of the tracking observer, with which the main sensor follows the recording.

Source: Ohnishi, Shibata & Murakami, Motion control for advanced mechatronics, IEEE/ASME Trans. Mechatronics 1 (1996).
"""

from typing import NamedTuple

import numpy as np

from rtctl.diagnose.answer.answer import GraphDiagnosis
from rtctl.diagnose.answer.words import channel_unit, here
from rtctl.diagnose.evidence.free import Free
from rtctl.diagnose.likelihood.likelihood import settled
from rtctl.diagnose.model.model import GraphModel
from rtctl.diagnose.model.node_scaling import speed, way
from rtctl.diagnose.model.simulate import Simulator
from rtctl.diagnose.search.suggestions import faster
from rtctl.plants.graph.description import Description
from rtctl.plants.graph.term_units import body_of
from rtctl.plants.physics import TERMS
from rtctl.plants.physics.dimensions import DIMENSIONS

CLEARER = 3.0  # signal-to-noise over that of the followed sensor, with which another sensor shows an effect
TURN = 360.0  # degrees
UNVISITED = 20.0  # degrees, least unvisited range at which the axis of the angle is cut


class Curve(NamedTuple):
    """Missing force or reading along an axis, rows (n,) each."""

    x: np.ndarray
    x_words: str  # with the unit as `x_unit`
    x_unit: str
    y: np.ndarray  # missing force or reading without the effect
    law: np.ndarray  # force or reading of the effect
    y_words: str
    y_unit: str
    title: str


class Missing:
    """Runs of the models of a diagnosis, for the curves."""

    def __init__(self, d: GraphDiagnosis):
        self.d, self.machine = d, d.record.case.machine
        self.sim: Simulator = d.found.like.sim
        self.best = d.decided.best.model
        self.fast = faster(self.sim)
        self.rows = slice(max(d.found.like.rows[0], settled(self.sim)), None)
        self._runs: dict[tuple[str, ...], tuple[np.ndarray, np.ndarray]] = {}

    def run(self, model: GraphModel) -> tuple[np.ndarray, np.ndarray]:
        """Readings (n, sensors) of a model under the fast observer, and corrections (n, followed); under the usual
        observer where the run diverges."""
        key = (*map(repr, model.terms), repr(sorted(model.base.items())))
        if key not in self._runs:
            for sim in (self.fast, self.sim):
                out, push = sim.everything(model)
                if np.isfinite(out).all():
                    break
            self._runs[key] = out, np.nan_to_num(push)
        return self._runs[key]

    def of(self, term: str, node: str, axis: str) -> Curve:
        """Curve of an effect of the best model; of the unnamed force where `term` is ""."""
        free = self.d.decided.unlisted
        if not term and free is not None and free.place.reads and free.node == node:
            return self._misread(free)
        known = TERMS.get(term)
        without, full = self._models(term, node)
        out0, push0 = self.run(without)
        out1, push1 = self.run(full)
        x, x_words, x_unit = self.abscissa(axis, node)
        channel = self._channel(known, node, out0, out1)
        at = here(self.machine, node)
        title = at.removeprefix("the ")
        if channel is not None:
            index = self.sim.column(channel)
            y = self.d.record.y[channel] - out0[:, index]
            law = out1[:, index] - out0[:, index]
            y, law = (v - np.median(v[self.rows]) for v in (y, law))
            unit = channel_unit(self.machine, channel)
            return Curve(x, x_words, x_unit, y, law, f"missing reading of {here(self.machine, channel)}", unit, title)
        body = self.node_body(node)
        factor, number = 1.0 / (self.sim.moves(self.sim.own(full).base).get(body, 0.0) or 1.0), self.sim.leader(body)
        push0, push1 = push0[:, number], push1[:, number]
        turns = self.machine.turns(body)
        what = "torque" if turns else "force"
        unit = DIMENSIONS["force"][not turns]
        words = f"missing {what} at {here(self.machine, body)}"
        return Curve(x, x_words, x_unit, factor * push0, factor * (push0 - push1), words, unit, title)

    def _misread(self, free: Free) -> Curve:
        """Curve of the unnamed error of a reading: the error plus the residual of an observer that follows the reading
        without the error."""
        error, channel = free.over(0), free.node
        out = self.sim.misread(channel, error).run(self.unnamed())
        left = self.d.record.y[channel] - out[:, self.sim.column(channel)]
        left = np.nan_to_num(left - np.median(left[self.rows]))
        at, unit = here(self.machine, channel), channel_unit(self.machine, channel)
        axis = self.abscissa(free.axis, channel)
        return Curve(*axis, left + error, error, f"missing reading of {at}", unit, at.removeprefix("the "))

    def node_body(self, node: str) -> str:
        """Body at which the force of a node is drawn; that of the followed sensor where the node has none."""
        body = body_of(self.machine, node)
        moving = body in self.machine.bodies and not self.machine.is_frame(body)
        return body if moving and self.sim.ratios.get(body, 0.0) != 0.0 else str(self.sim.body)

    def abscissa(self, axis: str, node: str) -> tuple[np.ndarray, str, str]:
        """Values (n,) of an axis, its words and unit."""
        record, body = self.d.record, self.node_body(node)
        x = way(self.sim, self.sim.leader(body)) * self.sim.ratios[body]
        turns, at = self.machine.turns(body), here(self.machine, body)
        if axis == "velocity":
            return speed(x, record.dt), f"speed of {at}", DIMENSIONS["speed"][not turns]
        if axis == "angle" and turns:
            return of_turn(x), f"angle of {at}", "degrees"
        if axis in ("position", "angle"):
            return x, f"position of {at}", DIMENSIONS["position"][not turns]
        if axis == "command" and record.u.shape[1]:
            number = self.sim.layout.drives.get(node, 0)
            drive = list(self.machine.drives.values())[number]
            return (
                record.u[:, number],
                f"command of {here(self.machine, list(self.machine.drives)[number])}",
                drive.unit,
            )
        return record.t - record.t[0], "time", "s"

    def speed(self, node: str) -> np.ndarray:
        """Speed (n,) of the body of a node, rad/s or m/s."""
        return self.abscissa("velocity", node)[0]

    def unnamed(self) -> GraphModel:
        """Model beside which the unnamed force was fitted."""
        return self.d.decided.beside.model

    def _models(self, term: str, node: str) -> tuple[GraphModel, GraphModel]:
        if not term:
            model = self.unnamed()
            return model, model
        known = self.best.known()  # nominal terms stay: their paths hold their index
        terms = [t for i, t in enumerate(self.best.terms) if i < known or (t.term, t.node) != (term, node)]
        return self.best._replace(terms=tuple(terms)), self.best

    def _channel(self, known, node: str, out0: np.ndarray, out1: np.ndarray) -> str | None:
        """Sensor whose reading shows an effect better than the correction; None for the correction."""
        others = [name for name in self.sim.channels if name != self.sim.main]
        if known is None or not others:
            return None
        if node in self.machine.sensors and node in others:
            return node
        if node not in self.machine.joints and node not in self.machine.sensors:
            return None
        change = {n: float(np.std((out1 - out0)[self.rows, self.sim.column(n)])) for n in self.sim.channels}
        least = dict(zip(self.sim.channels, self.d.found.like.least, strict=True))
        best = max(others, key=lambda n: change[n] / least[n])
        if self.sim.main not in change:  # its motion is given; of a static problem the correction is the missing force
            return best if self.sim.case.problem == "kinematic" else None
        return best if change[best] / least[best] > CLEARER * change[self.sim.main] / least[self.sim.main] else None


def subjects(d: GraphDiagnosis) -> list[tuple[str, str, str]]:
    """Term, node and axis of each panel: the effects, else the unnamed force, else the main body."""
    there = {(t.term, t.node) for t in d.decided.best.model.terms}
    found = [(e.name, e.node, TERMS[e.name].axis) for e in d.effects if (e.name, e.node) in there]
    if not found and d.located is not None and d.decided.unlisted is not None:
        found = [("", d.located.node, d.located.axis)]
    main = str(d.found.like.sim.body)
    return found or [("", main, "velocity"), ("", main, "position")]


def machine_words(machine: Description) -> str:
    """Machine in a few words: "motor and carriage"."""
    names = [name.replace("_", " ") for name in machine.bodies if not machine.is_frame(name)]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def of_turn(x: np.ndarray) -> np.ndarray:
    """Angles (n,) within one turn, degrees, from angles x (n,), rad, cut in the widest unvisited range: the visited
    range stays in one piece."""
    angle = np.degrees(np.mod(x, 2 * np.pi))
    visited = np.sort(angle)
    gaps = np.diff(visited, append=visited[0] + TURN)
    widest = int(np.argmax(gaps))
    if gaps[widest] < UNVISITED:
        return np.asarray(angle)
    cut = visited[widest] + 0.5 * gaps[widest]
    out = cut + np.mod(angle - cut, TURN)
    return np.asarray(out - TURN * np.round(np.median(out) / TURN))
