"""How fast, how far and how hard each node of a recording moves: what is large and what is small on this machine."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from rtctl.diagnose.record import Record
from rtctl.diagnose.simulate import way

SMOOTH = {"ivu": 0.01, "ldu": 2e-3, "axis": 5e-3}  # s, over which a speed is taken


def speed(x: np.ndarray, kind: str, dt: float) -> np.ndarray:
    """Rate (n,) of a reading, over a few ticks."""
    return np.gradient(uniform_filter1d(x, 2 * max(1, round(SMOOTH[kind] / dt)) + 1), dt)


def spaced(values: np.ndarray, low: float, high: float, count: int) -> np.ndarray:
    """Places (count,) among sorted values (n,): each step has the same sum of its shares of the way from low to high
    and of the values."""
    share = 0.5 * ((values - low) / ((high - low) or 1.0) + np.linspace(0.0, 1.0, len(values)))
    return np.interp(np.linspace(0.0, 1.0, count), share, values)


class Scales(NamedTuple):
    """Of one node: rms speed while it moves, span of its position, rms of the force that the drives put on it."""

    speed: float
    span: float
    force: float
    low: float  # lowest position
    back: bool = False  # whether it goes down as the main sensor goes up

    def at(self, share: float) -> float:
        """Position of the node where the main sensor has gone that share of its span."""
        return self.low + self.span * (1.0 - share if self.back else share)


def node_scales(record: Record, base: dict[str, float]) -> dict[str, Scales]:
    """Scales of every node in its own unit, from the main sensor and the owner's gear ratios."""
    x = way(record)
    step = max(1, round(SMOOTH[record.plant] / record.dt))
    v = (x[step:] - x[:-step]) / (step * record.dt)
    moving = np.abs(v) > 0.02 * np.abs(v).max(initial=1e-12)
    speed = float(np.sqrt(np.mean(v[moving] ** 2))) if moving.any() else 1e-12
    span, low = float(np.ptp(x)) or 1e-12, float(x.min())
    u = np.sqrt(np.mean((record.u - np.median(record.u, axis=0)) ** 2, axis=0)) + 1e-12
    out: dict[str, Scales] = {}

    def put(node: str, ratio: float, force: float) -> None:
        ends = sorted((low * ratio, (low + span) * ratio))
        out[node] = Scales(abs(ratio) * speed, ends[1] - ends[0], force, ends[0], ratio < 0.0)

    if record.plant == "ivu":
        amp = record.case.drive.amp_per_volt
        for i, sign in ((1, 1.0), (2, -1.0)):
            torque = base[f"K_m{i}"] * amp[i - 1] * float(u.max())
            ratio = sign * base["R_c"] / base[f"R{i}"]
            for node in (f"motor{i}", f"reel{i}"):
                put(node, ratio, torque)
            put(f"tape{i}", base["R_c"], torque / base[f"R{i}"])
        put("capstan", 1.0, out["motor1"].force * base["R_c"] / base["R1"])
        put("encoder", 1.0, out["capstan"].force)
    elif record.plant == "ldu":
        torque = base["K_m1"] * record.case.drive.amp_per_volt[0] * float(u[0])
        put("motor", base["N"], torque)
        for node in ("wheel", "capstan", "encoder"):
            put(node, 1.0, torque * base["N"])
        for node in ("carriage", "scale"):
            put(node, base["R_c"], torque * base["N"] / base["R_c"])
    else:
        for node in ("carriage", "sensor"):
            put(node, 1.0, base.get("K", 1.0) * float(u[0]))
    return out
