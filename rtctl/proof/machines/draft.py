"""Draft of a machine: bodies, joints and sensors drawn by a topology, without drives, law and motion."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rtctl.proof.machines.kinematics import inertia

Json = dict[str, Any]
Builder = Callable[[np.random.Generator, frozenset[str]], "Draft"]
BUILD: dict[str, Builder] = {}
ELASTIC, RIGID, TWO = "elastic", "rigid", "two"  # needs of effects: a spring, a rigid joint, two position sensors
LINES = (500, 1000, 1024, 2000, 2048, 2500)  # lines of rotary encoders; four counts a line


@dataclass
class Driver:
    name: str
    body: str
    share: float = 1.0  # share of the controller's output
    preload: float = 0.0  # share of the force that the machine needs
    kinds: tuple[str, ...] = ("force", "current", "voltage")


@dataclass
class Draft:
    words: str
    bodies: dict[str, Json]
    joints: dict[str, Json]
    sensors: dict[str, Json]
    control: str  # feedback sensor of the law
    drivers: list[Driver]
    fast: float  # top speed of the control sensor's body, unit/s
    step: float  # typical move of the control sensor's body
    reach: float  # largest distance from the start
    open_share: float = 0.0  # share of cases without a controller
    loop_hz: tuple[float, float] = (5.0, 11.0)
    rates: tuple[float, ...] = (500.0, 1000.0, 1000.0, 2000.0)
    speed_loop: bool = False
    one_way: bool = False  # turns in one direction only
    extra: Json = field(default_factory=dict)

    @property
    def machine(self) -> Json:
        return {"bodies": self.bodies, "joints": self.joints, "sensors": self.sensors}


def topology(name: str) -> Callable[[Builder], Builder]:
    """Register a builder."""

    def register(build: Builder) -> Builder:
        BUILD[name] = build
        return build

    return register


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform random number from `low` to `high`."""
    return float(low * math.exp(rng.uniform(0.0, math.log(high / low))))


def pick(rng: np.random.Generator, *choices: float) -> float:
    return float(choices[rng.integers(len(choices))])


def encoder(rng: np.random.Generator, body: str, column: str, times: float = 1.0) -> Json:
    """Rotary position counter with a usual number of lines; `times` is the ratio of a gear before it."""
    lines = LINES[rng.integers(len(LINES))]
    per_rad = round(4 * lines * times / (2.0 * math.pi), 5)
    return {"body": body, "measures": "position", "column": column, "counts_per_unit": per_rad}


def scale(rng: np.random.Generator, body: str, column: str) -> Json:
    """Linear scale: a counter, or a position in m or mm with a resolution."""
    per_m = pick(rng, 1e6, 1e6, 2e6, 2e5)
    if rng.random() < 0.7:
        return {"body": body, "measures": "position", "column": column, "counts_per_unit": per_m}
    to = pick(rng, 1.0, 1000.0)
    return {"body": body, "measures": "position", "column": column.replace("_counts", "_mm" if to > 1 else "_m"),
            "resolution": to / per_m, "per_unit": to}  # fmt: skip


def spring(
    rng: np.random.Generator, bodies: dict[str, Json], a: str, b: str, n: float, hz: tuple[float, float], rigid: bool,
    loss: tuple[float, float] = (0.02, 0.06),
) -> Json:  # fmt: skip
    """Joint whose isolated two-body mode has a frequency in `hz` and a damping ratio in `loss`; or a rigid joint."""
    if rigid:
        return {"from": a, "to": b, "ratio": n}
    near, far = inertia({"bodies": bodies}, a) / n**2, inertia({"bodies": bodies}, b)
    m = near * far / (near + far)
    w = 2.0 * math.pi * between(rng, *hz)
    k, d = m * w * w, 2.0 * rng.uniform(*loss) * m * w
    return {"from": a, "to": b, "ratio": n, "stiffness": float(f"{k:.6g}"), "damping": float(f"{d:.6g}")}


def wants_rigid(rng: np.random.Generator, need: frozenset[str], share: float) -> bool:
    """Whether an optionally rigid joint is rigid."""
    return RIGID in need or (ELASTIC not in need and rng.random() < share)


def both(rng: np.random.Generator, need: frozenset[str], shares: tuple[float, float, float]) -> tuple[bool, bool]:
    """Whether the first and the second sensor are mounted, by shares of (first alone, both, second alone)."""
    k = 1 if TWO in need else int(rng.choice(3, p=shares))
    return k <= 1, k >= 1
