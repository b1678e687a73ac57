"""Node scaling: characteristic speed, span, force, inertia and stiffness of a recording at each node."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.model.model import carried, moved_inertia, own
from rtctl.diagnose.model.simulate import Simulator
from rtctl.plants.element import Element
from rtctl.plants.graph.coupled import machine_params
from rtctl.plants.graph.elements import contacts
from rtctl.plants.graph.layout import NOWHERE, Layout
from rtctl.plants.graph.params import drive_gain
from rtctl.plants.graph.term_units import body_of
from rtctl.plants.physics import TERMS

SMOOTH = 5e-3  # s, half window of a speed
USUAL_RATE = 500.0  # 1/s, sample rate of a machine with natural frequencies of 3 to 225 Hz
ONE_WAY = 0.02  # of the travel in one direction: least travel in the other, for a motion in both
LITTLE = 1e-12  # lower bound of a measure, SI


class Scales(NamedTuple):
    """Scales of one node, in its own unit."""

    speed: float  # rms speed while the node moves
    span: float
    force: float  # rms force of the drives at the node
    low: float  # lowest position
    sign: float  # of its motion for a positive motion of the body of the main sensor

    def at(self, share: float) -> float:
        """Position of the node where the main sensor is at a share of its span."""
        return self.low + self.span * (1.0 - share if self.sign < 0.0 else share)


class Seen(NamedTuple):
    """Elements and tick of a recording, for the grid of starts (search/grid_starts.py)."""

    plant: tuple[Element, ...]
    dt: float  # s


class Measures:
    """Measures by name and node, from the main sensor, the ratios of the joints and the recorded commands."""

    def __init__(self, sim: Simulator, values: dict[str, float], hints: dict[str, list]):
        values = own(values, sim.record.name)
        self.sim, self.values, self.hints = sim, values, hints
        self.machine, self.layout = sim.case.machine, sim.layout
        dt = sim.record.dt
        self.ratios = sim.moves(values)
        self.leaders = {name: sim.leader(name) for name in self.ratios}
        self.inertias = machine_params(self.layout, values, dt).inertia
        self.u = sim.volts - np.median(sim.volts, axis=0)
        self.ways = [way(sim, number) for number in range(len(sim.followed))]
        self.speeds, self.efforts = [], []
        for number, x in enumerate(self.ways):
            v = speed(x, dt)
            moving = np.abs(v) > 0.02 * np.abs(v).max(initial=LITTLE)
            self.speeds.append(float(np.sqrt(np.mean(v[moving] ** 2))) if moving.any() else LITTLE)
            self.efforts.append(self._effort(number, float(np.std(np.gradient(v, dt)))))
        self.term = ""
        self.record = Seen(sim.elements, dt)

    def _effort(self, number: int, a: float) -> float:
        """Rms force of all drives at a followed body, N or Nm; at least a share of inertia times acceleration `a`."""
        total = np.zeros(len(self.u))
        for name, channel in self.layout.drives.items():
            drive = self.machine.drives[name]
            body = str(drive.body or self.machine.joints[str(drive.joint)].to)
            if self.leaders.get(body, 0) == number:
                total += drive_gain(self.values, name) * self.ratios.get(body, 0.0) * self.u[:, channel]
        found = float(np.sqrt(np.mean(total**2)))
        share = 0.1 if found > 0.0 or not number else 1.0  # another body moves a body without a drive
        return max(found, share * self.inertia(self.sim.followed[number].body) * a, LITTLE)

    def body_of(self, node: str) -> str:
        """Body of a node; that of the followed sensor where the node has none."""
        return body_of(self.machine, node) or str(self.sim.body)

    def scale(self, node: str) -> Scales:
        """Scales of a node."""
        body, arm = self.lever(node)
        ratio, number = arm * (self.ratios.get(body, 1.0) or 1.0), self.leaders.get(body, 0)
        x = self.ways[number]
        ends = sorted((float(x.min()) * ratio, float(x.max()) * ratio))
        return Scales(
            abs(ratio) * self.speeds[number],
            max(ends[1] - ends[0], LITTLE),
            self.efforts[number] / abs(ratio),
            ends[0],
            np.sign(ratio),
        )

    def lever(self, node: str) -> tuple[str, float]:
        """Body by which a node moves, and the motion of the node for one unit of the body: a span of tape and a driven
        contact have a lever arm."""
        at = lever(self.layout, self.values, node, bool(self.term) and TERMS[self.term].contact)
        return at if at is not None else (self.body_of(node), 1.0)

    def way(self, body: str) -> np.ndarray:
        """Position (n,) of a body, rad or m, by the followed sensor that joints connect it with."""
        return np.asarray(self.ways[self.leaders.get(body, 0)] * self.ratios.get(body, 0.0))

    def both_ways(self, node: str) -> bool:
        """Whether a node moves in both directions."""
        moved = np.diff(self.way(self.lever(node)[0]))
        parts = np.sum(np.maximum(moved, 0.0)), np.sum(np.maximum(-moved, 0.0))
        return bool(min(parts) > ONE_WAY * max(*parts, LITTLE))

    def turns(self, node: str) -> bool:
        """Whether the body of a node turns."""
        return self.machine.turns(self.body_of(node))

    def of(self, measure: str, node: str) -> float:
        """Value of a measure at a node, SI."""
        s = self.scale(node)
        volts = max(self.volts(""), LITTLE)
        stiffness = self.stiffness(node)
        peak = float(np.abs(self.sim.volts).max(initial=0.0))
        table = {
            "one": 1.0, "force": s.force, "speed": s.speed, "span": s.span, "low": s.low, "per_span2": s.span**-2,
            "drag": s.force / s.speed, "drag2": s.force / s.speed**2, "stiff": s.force / s.span,
            "twist": self.twist(node, s.force / stiffness),
            "cubic": stiffness**3 / s.force**2, "square": stiffness**2 / s.force,
            "swell": s.force / (s.speed * s.span**2), "stiffness": stiffness, "firm": self.firm(node),
            "compliance": 1.0 / s.force, "yield": s.speed / s.force, "inertia": self.inertia(node), "seconds": 1.0,
            "ring": min(1.0, 1.0 / (USUAL_RATE * self.sim.record.dt)), "tick": self.sim.record.dt, "driver": 0.0,
            "duration": len(self.u) * self.sim.record.dt, "volts": max(self.volts(node), 0.05 * volts),
            "per_volt": 1.0 / volts, "peak": max(peak, LITTLE), "pace": self.pace(node),
            "grain": self.grain(node), "counts": self.grain(node), "grip": s.force, "contact": s.force,
        }  # fmt: skip
        return table[measure]

    def pace(self, node: str) -> float:
        """Highest rate of the command of a drive, in its unit a second."""
        u = self.sim.volts
        u = u[:, [self.layout.drives[node]]] if node in self.layout.drives else u
        if not u.size:
            return LITTLE
        return max(float(np.abs(np.diff(u, axis=0)).max()) / self.sim.record.dt, LITTLE)

    def volts(self, node: str) -> float:
        """Rms command of the drive that the node names, or of all drives."""
        u = self.sim.volts
        u = u[:, self.layout.drives[node]] if node in self.layout.drives else u
        return float(np.sqrt(np.mean(u**2))) if u.size else LITTLE

    def grain(self, node: str) -> float:
        """Resolution of the followed sensor at a node, or of the sensor at `node` itself, SI."""
        record = self.sim.record
        if node in record.grain:
            return record.grain[node] or LITTLE
        body = self.body_of(node)
        sensor = self.sim.followed[self.leaders.get(body, 0)].sensor
        return (record.grain[sensor] or LITTLE) * abs(self.ratios.get(body, 1.0) or 1.0)

    def dry(self, node: str) -> float:
        """Dry friction of the model at a body, N or Nm, with that of all rigidly joined bodies."""
        return self._friction(node, "dry", 1)

    def thick(self, node: str) -> float:
        """Viscous friction of the model at a body, Ns/m or Nms/rad, with that of all rigidly joined bodies."""
        return self._friction(node, "viscous", 2)

    def _friction(self, node: str, key: str, power: int) -> float:
        place = self.layout.bodies.get(node)
        if place is None or place.coordinate == NOWHERE:
            return 0.0
        own = abs(self.layout.ratio(node, self.values))
        total = sum(
            abs(self.layout.ratio(name, self.values)) ** power * self.values.get(f"bodies.{name}.{key}", 0.0)
            for name, other in self.layout.bodies.items()
            if other.coordinate == place.coordinate
        )
        return float(total / own**power)

    def inertia(self, node: str) -> float:
        """Inertia or mass of all bodies that move with a node, reflected to the node, kg m^2 or kg."""
        body = self.body_of(node)
        number = self.leaders.get(body, 0)
        ratios = {name: ratio for name, ratio in self.ratios.items() if self.leaders[name] == number}
        total = moved_inertia(self.inertias, carried(self.layout, self.values, ratios))
        return total / (self.ratios.get(body, 1.0) or 1.0) ** 2

    def stiffness(self, node: str) -> float:
        """Stiffness of a joint; elsewhere of a spring that the drives stretch over the span, N/m or Nm/rad."""
        s = self.scale(node)
        return self.values.get(f"joints.{node}.stiffness", 0.0) or s.force / s.span

    def twist(self, node: str, usual: float) -> float:
        """Deflection of a joint, rad or m: `usual`, in a kinematic problem at least the difference of the positions."""
        sim, sensors = self.sim, self.machine.sensors
        if sim.case.problem != "kinematic":
            return usual
        apart = []
        for name in sim.channels:
            ratio = self.ratios.get(str(sensors[name].body), 0.0)
            if sensors[name].measures == "position" and ratio != 0.0:
                off = float(np.std(sim.record.y[name] - ratio * self.way(str(sim.body)))) / abs(ratio)
                apart.append(off * abs(self.ratios.get(self.body_of(node), 1.0)))
        return max([usual, *apart])

    def firm(self, node: str) -> float:
        """Stiffness of a joint whose lighter side has a natural frequency of 0.02 of the sample rate, N/m or Nm/rad."""
        if node not in self.machine.joints:
            return self.stiffness(node)
        far = self.machine.joints[node].to
        near = getattr(self.machine.joints[node], "from")
        sides = [self._own(name) * (self.ratios.get(name, 1.0) / (self.ratios.get(far, 1.0) or 1.0)) ** 2
                 for name in (near, far) if name in self.machine.bodies]  # fmt: skip
        return (2 * np.pi * 0.02 / self.sim.record.dt) ** 2 * min(sides)

    def _own(self, name: str) -> float:
        """Inertia or mass of one body, kg m^2 or kg."""
        return self.values[f"bodies.{name}.{'inertia' if self.machine.bodies[name].turns else 'mass'}"]

    def most(self, parameter: str) -> float:
        """Highest value that the settings of the term allow."""
        bounds = TERMS[self.term].settings.model_fields[parameter].metadata
        return float(min((b.le for b in bounds if hasattr(b, "le")), default=np.inf))


def lever(layout: Layout, values: dict[str, float], node: str, contact: bool) -> tuple[str, float] | None:
    """Body and lever arm of a span of tape, or of a contact where `contact`; None of any other node."""
    machine = layout.machine
    touching = contacts(machine).get(node) if contact else None
    if touching is not None and touching.joint:
        return str(machine.joints[touching.joint].to), 1.0
    if touching is not None:
        return node, values[f"bodies.{node}.radius"]
    if node in machine.joints and machine.joints[node].span is not None:
        body = str(machine.joints[node].to)
        return body, values[f"bodies.{body}.radius"]
    return None


def speed(x: np.ndarray, dt: float) -> np.ndarray:
    """Rate (n,) of a position x (n,), smoothed over a few ticks, per s."""
    return np.asarray(np.gradient(uniform_filter1d(x, 2 * max(1, round(SMOOTH / dt)) + 1), dt))


def way(sim: Simulator, number: int = 0) -> np.ndarray:
    """Position (n,) of a followed body by its sensor, rad or m; of a speed the integral from row 0."""
    if sim.followed[number].shows_speed:
        return np.asarray(np.cumsum(sim.watched[:, number]) * sim.record.dt)
    return np.asarray(sim.watched[:, number])
