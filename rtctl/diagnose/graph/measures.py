"""Measures of a recording at each node: what is large and what is small there."""

from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.graph.model import rigid
from rtctl.diagnose.graph.simulate import Simulator
from rtctl.plants.element import Element
from rtctl.plants.graph.elements import contacts
from rtctl.plants.graph.layout import NOWHERE, Layout
from rtctl.plants.physics import TERMS

SMOOTH = 5e-3  # s, over which a speed is taken
USUAL_RATE = 500.0  # 1/s, of a machine whose parts ring at 3 to 225 Hz
LITTLE = 1e-12


class Scales(NamedTuple):
    """Of one node, in its own unit."""

    speed: float  # rms while it moves
    span: float
    force: float  # rms of what the drives make of it there
    low: float  # lowest position
    sign: float  # of its motion for one of the main sensor's body

    def at(self, share: float) -> float:
        """Position of the node where the main sensor has gone that share of its span."""
        return self.low + self.span * (1.0 - share if self.sign < 0.0 else share)


class Seen(NamedTuple):
    """What the starts of a search ask of a recording (rtctl.diagnose.hypotheses)."""

    plant: tuple[Element, ...]
    dt: float  # s


class Measures:
    """Measures by name and node, from the main sensor, the ratios of the joints and the recorded commands."""

    def __init__(self, sim: Simulator, values: dict[str, float], hints: dict[str, list]):
        self.sim, self.values, self.hints = sim, values, hints
        self.machine, self.layout = sim.case.machine, sim.layout
        self.way = way(sim)
        dt = sim.record.dt
        v = speed(self.way, dt)
        moving = np.abs(v) > 0.02 * np.abs(v).max(initial=LITTLE)
        self.v_main = float(np.sqrt(np.mean(v[moving] ** 2))) if moving.any() else LITTLE
        self.a_main = float(np.std(np.gradient(v, dt)))
        self.ratios = rigid(self.layout, values, str(sim.body))
        self.u = sim.volts - np.median(sim.volts, axis=0)
        self.effort = self._effort()
        self.term = ""
        self.record = Seen(sim.elements, dt)

    def _effort(self) -> float:
        """Rms of what all drives make at the main body, N or Nm."""
        total = np.zeros(len(self.way))
        for name, number in self.layout.drives.items():
            drive = self.machine.drives[name]
            path = f"drives.{name}"
            gain = self.values[f"{path}.gain"] * self.values.get(f"{path}.torque_constant", 1.0)
            gain /= self.values.get(f"{path}.resistance", 1.0)
            bodies = [drive.body] if drive.body else [self.machine.joints[str(drive.joint)].to]
            total += gain * self.ratios.get(str(bodies[0]), 0.0) * self.u[:, number]
        found = float(np.sqrt(np.mean(total**2)))
        return max(found, 0.1 * self.inertia(str(self.sim.body)) * self.a_main, LITTLE)

    def body_of(self, node: str) -> str:
        """The body that a node belongs to: its own, that at the far end of a joint, that of a drive or sensor."""
        m = self.machine
        if node in m.bodies:
            return node
        if node in m.joints:
            joint = m.joints[node]
            return joint.to if not m.is_frame(joint.to) else getattr(joint, "from")
        for group in (m.drives, m.sensors):
            if node in group:
                element: Any = group[node]
                if element.body is not None:
                    return str(element.body)
                if element.joint is not None:
                    return self.body_of(element.joint)
                return self.body_of(element.drive)
        return str(self.sim.body)

    def scale(self, node: str) -> Scales:
        """Scales of a node."""
        ratio = self.ratio(node)
        ends = sorted((float(self.way.min()) * ratio, float(self.way.max()) * ratio))
        return Scales(
            abs(ratio) * self.v_main, max(ends[1] - ends[0], LITTLE), self.effort / abs(ratio), ends[0], np.sign(ratio)
        )

    def ratio(self, node: str) -> float:
        """What a node moves for one unit of the main sensor's body; tape, and what a contact drives, in their own."""
        at = lever(self.layout, self.values, node, bool(self.term) and TERMS[self.term].contact)
        body, arm = at if at is not None else (self.body_of(node), 1.0)
        return arm * (self.ratios.get(body, 1.0) or 1.0)

    def turns(self, node: str) -> bool:
        """Whether what a node belongs to turns."""
        return self.machine.turns(self.body_of(node))

    def of(self, measure: str, node: str) -> float:
        """The measure in SI at a node."""
        s = self.scale(node)
        volts = max(float(np.sqrt(np.mean(self.sim.volts**2))), LITTLE)
        stiffness = self.stiffness(node)
        peak = float(np.abs(self.sim.volts).max(initial=0.0))
        table = {
            "one": 1.0, "force": s.force, "speed": s.speed, "span": s.span, "low": s.low,
            "drag": s.force / s.speed, "drag2": s.force / s.speed**2, "stiff": s.force / s.span,
            "twist": s.force / stiffness, "cubic": stiffness**3 / s.force**2, "square": stiffness**2 / s.force,
            "swell": s.force / (s.speed * s.span**2), "stiffness": stiffness, "firm": self.firm(node),
            "compliance": 1.0 / s.force, "inertia": self.inertia(node), "seconds": 1.0,
            "ring": min(1.0, 1.0 / (USUAL_RATE * self.sim.record.dt)), "tick": self.sim.record.dt, "driver": 0.0,
            "duration": len(self.way) * self.sim.record.dt, "volts": max(self.volts(node), 0.05 * volts),
            "per_volt": 1.0 / volts, "peak": max(peak, LITTLE), "pace": self.pace(node),
            "grain": self.grain(node), "counts": self.grain(node), "grip": s.force, "contact": s.force,
        }  # fmt: skip
        return table[measure]

    def pace(self, node: str) -> float:
        """Fastest rate of the command of a drive, in its unit a second."""
        u = self.sim.volts
        u = u[:, [self.layout.drives[node]]] if node in self.layout.drives else u
        if not u.size:
            return LITTLE
        return max(float(np.abs(np.diff(u, axis=0)).max()) / self.sim.record.dt, LITTLE)

    def volts(self, node: str) -> float:
        """Rms command of the drive that the node names, or of all."""
        u = self.sim.volts
        u = u[:, self.layout.drives[node]] if node in self.layout.drives else u
        return float(np.sqrt(np.mean(u**2))) if u.size else LITTLE

    def grain(self, node: str) -> float:
        """Step of the main sensor as the node moves, or of the sensor that the node is, SI."""
        record = self.sim.record
        if node in record.grain:
            return record.grain[node] or LITTLE
        return (record.grain[self.sim.main] or LITTLE) * abs(self.ratios.get(self.body_of(node), 1.0) or 1.0)

    def dry(self, node: str) -> float:
        """Dry friction of the model at a body, with that of all bodies that move with it."""
        return self._friction(node, "dry", 1)

    def thick(self, node: str) -> float:
        """Viscous friction of the model at a body."""
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
        """Inertia or mass of all that moves, as the node feels it."""
        total = 0.0
        for name, body in self.machine.bodies.items():
            if name in self.ratios:
                key = "inertia" if body.turns else "mass"
                total += self.ratios[name] ** 2 * self.values[f"bodies.{name}.{key}"]
        return float(total / (self.ratios.get(self.body_of(node), 1.0) or 1.0) ** 2)

    def stiffness(self, node: str) -> float:
        """Of a joint; elsewhere of a spring that the drives stretch over the span."""
        s = self.scale(node)
        return self.values.get(f"joints.{node}.stiffness", 0.0) or s.force / s.span

    def firm(self, node: str) -> float:
        """Stiffness of a joint with which the lighter of its two sides rings at a tenth of the sample rate."""
        if node not in self.machine.joints:
            return self.stiffness(node)
        far = self.machine.joints[node].to
        near = getattr(self.machine.joints[node], "from")
        sides = [self._own(name) * (self.ratios.get(name, 1.0) / (self.ratios.get(far, 1.0) or 1.0)) ** 2
                 for name in (near, far) if name in self.machine.bodies]  # fmt: skip
        return (2 * np.pi * 0.02 / self.sim.record.dt) ** 2 * min(sides)

    def _own(self, name: str) -> float:
        """Inertia or mass of one body."""
        return self.values[f"bodies.{name}.{'inertia' if self.machine.bodies[name].turns else 'mass'}"]

    def most(self, parameter: str) -> float:
        """The highest value that the term's settings allow."""
        bounds = TERMS[self.term].settings.model_fields[parameter].metadata
        return float(min((b.le for b in bounds if hasattr(b, "le")), default=np.inf))


def lever(layout: Layout, values: dict[str, float], node: str, contact: bool) -> tuple[str, float] | None:
    """Body and arm of what a span of tape, or where `contact` says so a contact, passes on; None of any other node."""
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
    """Rate (n,) of a position, over a few ticks."""
    return np.asarray(np.gradient(uniform_filter1d(x, 2 * max(1, round(SMOOTH / dt)) + 1), dt))


def way(sim: Simulator) -> np.ndarray:
    """Position of the main body as its sensor saw it, (n,) rad or m; of a speed the way since row 0."""
    if sim.shows_speed:
        return np.asarray(np.cumsum(sim.seen) * sim.record.dt)
    return sim.seen
