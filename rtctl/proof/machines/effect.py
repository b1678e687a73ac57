"""Table of effects: change of the true machine, possible nodes, and entries in the answers.

Size 1 is a typical amplitude. Sizes scale with the machine's trajectories without effects: one rule fits every
topology. Each name has two or more forms, of which a library has at most one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rtctl.proof.machines.arrays import NB, VOLTAGE
from rtctl.proof.machines.kinematics import alike, ratios, reflected, rotary
from rtctl.proof.machines.setup import Setup

Sizes = dict[str, float]
Maker = Callable[[Setup, str, float, np.random.Generator], Sizes]
Where = Callable[[Setup], list[str]]


class UnfitError(Exception):
    """Effect invisible on this machine or in this motion; another machine is drawn."""


@dataclass(frozen=True)
class Entry:
    make: Maker
    where: Where
    axes: tuple[str, ...]
    need: frozenset[str]


TABLE: dict[str, Entry] = {}


def effect(name: str, where: Where, axes: tuple[str, ...], *need: str) -> Callable[[Maker], Maker]:
    """Register a maker under a name of the table of format 2."""

    def register(make: Maker) -> Maker:
        TABLE[name] = Entry(make, where, axes, frozenset(need))
        return make

    return register


def about(rng: np.random.Generator, value: float, spread: float = 0.35) -> float:
    """Log-uniform random number within a factor e^+-spread of `value`."""
    return float(value * math.exp(rng.uniform(-spread, spread)))


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def form(rng: np.random.Generator, count: int) -> int:
    return int(rng.integers(count))


def bodies(s: Setup) -> list[str]:
    return list(s.machine["bodies"])


def rotary_bodies(s: Setup) -> list[str]:
    return [b for b in bodies(s) if rotary(s.machine, b)]


def springs(s: Setup) -> list[str]:
    return [j for j, joint in s.machine["joints"].items() if "stiffness" in joint]


def drives(s: Setup) -> list[str]:
    return list(s.machine["drives"])


def loop(s: Setup) -> list[str]:
    return ["loop"]


def on_body(s: Setup, *measures: str) -> list[str]:
    """Sensors of a body that measure one of `measures`."""
    return [n for n, x in s.machine["sensors"].items() if "body" in x and x["measures"] in measures]


def measure(s: Setup, run: dict[str, np.ndarray]) -> None:
    """Store the trajectories of the machine without effects, the scale of effect sizes."""
    states = run["states"]
    total = np.zeros(s.n)
    for d, drive in enumerate(s.machine["drives"].values()):
        f = run["forces"][:, d]
        if s.m["d_kind"][d] == VOLTAGE:
            f = s.m["d_Kt"][d] * (f - s.m["d_Kt"][d] * states[:, NB + s.body(drive["body"])]) / s.m["d_R"][d]
        total += f * ratios(s.machine, s.base)[drive["body"]]
    s.seen = {"q": states[:, :NB], "v": states[:, NB:], "T": run["joints"], "base_force": total,
              "command": np.stack([run[c] for c in s.commands], axis=1), "forces": run["forces"]}  # fmt: skip


def speed(s: Setup, node: str) -> float:
    """90 % quantile of a body's speed."""
    return max(float(np.quantile(np.abs(s.seen["v"][:, s.body(node)]), 0.9)), 1e-12)


def span(s: Setup, node: str) -> float:
    return float(np.ptp(s.seen["q"][:, s.body(node)]))


def level(s: Setup, node: str) -> float:
    """Scale of forces (N, Nm) at a body, from its dry friction and the drive forces."""
    g = abs(ratios(s.machine, s.base)[node])
    return max(float(s.m["b_F"][s.body(node)]), 0.18 * float(np.std(s.seen["base_force"])) / g)


def inertia_at(s: Setup, node: str) -> float:
    """Inertia of the whole machine reflected to a body."""
    return reflected(s.machine, node)


def joint_force(s: Setup, node: str) -> float:
    """Standard deviation of the force in a joint (N, Nm)."""
    return max(float(np.std(s.seen["T"][:, s.joint(node)])), 1e-12)


def command(s: Setup, node: str) -> float:
    """Standard deviation of the command of a drive."""
    return max(float(np.std(s.seen["command"][:, s.drive(node)])), 1e-12)


def crossed(s: Setup, node: str, rng: np.random.Generator) -> float:
    """Random position that the body crosses often."""
    return float(np.quantile(s.seen["q"][:, s.body(node)], rng.uniform(0.25, 0.75)))


def nodes_ok(s: Setup, name: str, node: str) -> set[str]:
    """Nodes that count as right: the effect changes every reading equally there."""
    out = {node}
    if node in s.machine["bodies"]:
        out |= alike(s.machine, node, s.band_hz)
    elif node in s.machine["joints"]:
        out |= {s.machine["joints"][node]["from"], s.machine["joints"][node]["to"]}
    elif node in s.machine["sensors"] and name == "sensor.scale":
        for other, sensor in s.machine["sensors"].items():
            if sensor["measures"] == "position" and "body" in sensor:
                out |= {other, sensor["body"]}
    elif node in s.machine["sensors"]:
        out.add(s.machine["sensors"][node].get("body", node))
    elif node == "loop":
        out |= set(s.machine["drives"])
    if name in ("drive.offset", "drive.back_emf", "drive.thermal", "ripple.torque") and node in s.machine["drives"]:
        out |= alike(s.machine, s.machine["drives"][node]["body"], s.band_hz)
    if name in ("drive.supply_sag", "drive.offset"):  # one supply; a constant force acts equally at any drive
        out |= set(s.machine["drives"])
        out |= {drive["body"] for drive in s.machine["drives"].values()} if name == "drive.offset" else set()
    if name == "structure.resonance":
        for joint_name, joint in s.machine["joints"].items():
            if node in (joint["from"], joint["to"]):
                out |= {joint_name, joint["from"], joint["to"]}
    for twin in names_ok(s, name, node) - {name}:
        if twin.startswith("drive."):
            out |= set(s.machine["drives"])
        elif name.startswith("drive."):
            out |= set(s.machine["bodies"])
    return out


def names_ok(s: Setup, name: str, node: str) -> set[str]:
    """The name and its equivalents on this machine."""
    out, linear = {name}, any(not rotary(s.machine, b) for b in bodies(s))
    force = all(drive["kind"] != "voltage" for drive in s.machine["drives"].values())
    driven = {drive["body"] for drive in s.machine["drives"].values()}
    if name == "load.gravity":
        out.add("load.imbalance" if rotary(s.machine, node) else "drive.offset")
    elif name == "load.imbalance" or (name == "drive.offset" and linear):
        out.add("load.gravity")
    elif name == "drive.back_emf":
        out.add("friction.viscous")
    elif name == "friction.viscous" and force and nodes_ok_body(s, node) & driven:
        out.add("drive.back_emf")
    return out


def nodes_ok_body(s: Setup, node: str) -> set[str]:
    return alike(s.machine, node, s.band_hz) if node in s.machine["bodies"] else {node}
