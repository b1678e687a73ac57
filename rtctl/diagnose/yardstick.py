"""What the sizes and shapes of a hypothesis are measured by: what the recording itself shows of a node."""

import numpy as np

from rtctl.diagnose.model import dry_friction
from rtctl.diagnose.record import Record
from rtctl.diagnose.scales import Scales
from rtctl.diagnose.simulate import per_unit, resolution
from rtctl.diagnose.stretches import rms
from rtctl.plants.physics import TERMS

USUAL_RATE = 500.0  # Hz, of a machine whose parts ring at 3 to 225 Hz
LITTLE = 0.05  # of the command of all drives: one that does less has no measure of its own


class Measures:
    """What a size or a shape is measured by, at a node."""

    def __init__(self, record: Record, base: dict[str, float], scales: dict[str, Scales], hints: dict[str, list]):
        self.record, self.base, self.scales, self.hints = record, base, scales, hints
        self.grain = resolution(record)  # of a speed it is a regression, and a table asks for it with every measure
        self.term = ""

    def most(self, parameter: str) -> float:
        """The highest value that the term's settings allow."""
        bounds = TERMS[self.term].settings.model_fields[parameter].metadata
        return float(min((b.le for b in bounds if hasattr(b, "le")), default=np.inf))

    def scale(self, node: str) -> Scales:
        """Of the node, or of the main node for a drive or the loop."""
        return self.scales.get(node) or next(iter(self.scales.values()))

    def of(self, measure: str, node: str) -> float:
        """The measure in SI at a node."""
        s = self.scale(node)
        volts = rms(self.record.u)
        drive = self.record.case.drive
        table = {
            "one": 1.0,
            "force": s.force,
            "speed": s.speed,
            "span": s.span,
            "low": s.low,
            "drag": s.force / s.speed,
            "drag2": s.force / s.speed**2,
            "stiff": s.force / s.span,
            "twist": s.force / self.stiffness(node),
            "cubic": self.stiffness(node) ** 3 / s.force**2,
            "square": self.stiffness(node) ** 2 / s.force,
            "swell": s.force / (s.speed * s.span**2),
            "stiffness": self.stiffness(node),
            "compliance": 1.0 / s.force,
            "inertia": self.inertia(node),
            "seconds": 1.0,
            "ring": min(1.0, 1.0 / (USUAL_RATE * self.record.dt)),  # who samples slowly looks at what is slow
            "tick": self.record.dt,
            "driver": (self.record.case.reaches.parameter_tolerance or 0.0) * drive.late,
            "duration": len(self.record.t) * self.record.dt,
            "volts": max(self.volts(node), LITTLE * volts),
            "grain": self.grain * s.span / (self.scales.get("encoder") or self.scales["sensor"]).span,
            "counts": 1.0 / per_unit(self.record.case)[-1 if node == "scale" else 0],
            "per_volt": 1.0 / volts,
            "firm": self.stiffness(node),
            "pace": float(np.abs(np.diff(self.record.u, axis=0)).max()) / self.record.dt,
            "limit": drive.limit_volt or float(np.abs(self.record.u).max()),
            "peak": float(np.abs(self.record.u).max()),
        }
        return table[measure]

    def volts(self, node: str) -> float:
        """Rms command of the drive that the node names, or of all."""
        u = self.record.u
        return rms(u[:, int(node[-1]) - 1] if node[-1].isdigit() and u.shape[1] > 1 else u)

    def dry(self, node: str) -> float:
        """Dry friction of the base at a node, in its own unit."""
        return dry_friction(self.record.plant, self.base, node)

    def thick(self, node: str) -> float:
        """Viscous friction of the base that a node feels, in its own unit."""
        b = self.base
        if self.record.plant == "ldu":
            turning = b["B_c"] + b["R_c"] ** 2 * b["B_m"]
            return {"carriage": turning / b["R_c"] ** 2, "motor": b["K_m2"] + turning / b["N"] ** 2}.get(node, turning)
        return b.get("F_v", 0.0)

    def inertia(self, node: str) -> float:
        """Inertia or mass that moves with a node."""
        b = self.base
        if self.record.plant == "ivu":
            total = b["J_m1"] / b["R1"] ** 2 + b["J_m2"] / b["R2"] ** 2
            return (
                total
                * {"motor1": b["R1"], "reel1": b["R1"], "motor2": b["R2"], "reel2": b["R2"]}.get(node, b["R_c"]) ** 2
            )
        if self.record.plant == "ldu":
            mass = b["M"] + (b["J_m"] * b["N"] ** 2 + b["J_t"]) / b["R_c"] ** 2
            lever = {"motor": b["R_c"] / b["N"], "carriage": 1.0, "scale": 1.0}.get(node, b["R_c"])
            return mass * lever**2
        return b.get("M", 1.0)

    def stiffness(self, node: str) -> float:
        """Of the spring that the node names; where it has none, of one that the drive stretches over the span."""
        names = {
            "ivu": {"tape1": "c1", "tape2": "c2", "motor1": "c_m1", "motor2": "c_m2"},
            "ldu": {"motor": "k_s", "wheel": "k_s", "capstan": "k_c", "encoder": "k_c"},
            "axis": {"carriage": "k"},
        }[self.record.plant]
        value = self.base.get(names.get(node, ""), 0.0)
        s = self.scale(node)
        return value or s.force / s.span
