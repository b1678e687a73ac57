"""Conversion of a description (exchange format 2) to the record of the true machine, and its nominal values."""

import copy
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from rtctl.proof.machines import arrays

Json = dict[str, Any]
EXACT = ("ratio", "limit", "dac_bits", "dac_range", "counts_per_unit", "resolution", "per_unit", "incline", "angle")
WELL_KNOWN = {
    "inertia": 0.03,
    "mass": 0.03,
    "arm": 0.03,
    "torque_constant": 0.05,
}  # relative tolerance, by the last word of the key
ORDINARY = 0.15  # relative tolerance of other numbers
MEASURES = {"position": arrays.POSITION, "speed": arrays.SPEED, "acceleration": arrays.ACCELERATION}


def gravities(body: Json) -> list[Json]:
    """Entries of a body's gravity."""
    g = body.get("gravity", [])
    return [g] if isinstance(g, dict) else list(g)


def record(machine: Json, Ts: float, delay: float) -> np.ndarray:
    """Record () of the machine in a description with true values, with a solver step of at most 50 us."""
    m = arrays.neutral()
    m["Ts"], m["delay"], m["sub"] = Ts, delay, max(20.0, math.ceil(Ts / 5e-5 - 1e-9))
    bodies, joints = list(machine["bodies"]), list(machine["joints"])
    for name, body in machine["bodies"].items():
        i = arrays.add_body(m, body.get("inertia", body.get("mass", 0.0)))
        m["b_F"][i], m["b_B"][i] = body.get("dry", 0.0), body.get("viscous", 0.0)
        k = 0
        for g in gravities(machine["bodies"][name]):
            if "incline" in g:
                m["b_gc"][i] = body["mass"] * arrays.GRAVITY * math.sin(g["incline"])
            else:
                m["b_g"][i, k], m["b_ga"][i, k] = g["mass"] * arrays.GRAVITY * g["arm"], g["angle"]
                k += 1
    for joint in machine["joints"].values():
        a, b = bodies.index(joint["from"]), bodies.index(joint["to"])
        j = arrays.add_joint(m, a, b, joint["ratio"], joint.get("stiffness", 0.0), joint.get("damping", 0.0))
        m["j_rigid"][j] = float("stiffness" not in joint)
    for d, drive in enumerate(machine["drives"].values()):
        m["nd"] = d + 1
        m["d_at"][d] = bodies.index(drive["body"])
        m["d_kind"][d] = arrays.VOLTAGE if drive["kind"] == "voltage" else arrays.FORCE
        m["d_Kt"][d] = drive.get("torque_constant", 1.0)
        m["d_gain"][d] = drive["gain"] * (m["d_Kt"][d] if drive["kind"] == "current" else 1.0)
        m["d_R"][d], m["d_L"][d] = drive.get("resistance", 1.0), drive.get("inductance", 0.0)
        m["d_w"][d] = 2.0 * math.pi * drive.get("bandwidth_hz", 0.0)
        m["d_z"][d] = drive.get("damping", 0.7)
    for s, sensor in enumerate(machine["sensors"].values()):
        m["ns"] = s + 1
        m["s_counter"][s] = float("counts_per_unit" in sensor)
        m["s_gain"][s] = sensor.get("counts_per_unit", sensor.get("per_unit", 1.0) / sensor.get("resolution", 1.0))
        if "joint" in sensor:
            m["s_at"][s] = joints.index(sensor["joint"])
            m["s_what"][s] = arrays.LOAD if sensor["measures"] == "force" else arrays.STRETCH
        elif "drive" in sensor:
            m["s_at"][s], m["s_what"][s] = list(machine["drives"]).index(sensor["drive"]), arrays.CURRENT
        else:
            m["s_at"][s], m["s_what"][s] = bodies.index(sensor["body"]), MEASURES[sensor["measures"]]
    arrays.coordinates(m)
    arrays.bristles(m)
    return m


def numbers(machine: Json | list[Any], path: str = "") -> Iterator[tuple[str, float]]:
    """Dotted paths and values of all numbers of a description."""
    items = enumerate(machine) if isinstance(machine, list) else machine.items()
    for key, value in items:
        at = f"{path}.{key}" if path else str(key)
        if isinstance(value, dict | list):
            yield from numbers(value, at)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield at, float(value)


def tolerance(path: str) -> float:
    """Relative tolerance of the nominal value at a dotted path."""
    key = path.rsplit(".", 1)[-1]
    if key in EXACT or key == "noise":
        return 0.0
    return WELL_KNOWN.get(key, ORDINARY)


def believe(machine: Json, rng: np.random.Generator, edge: bool) -> tuple[Json, dict[str, float], dict[str, float]]:
    """Nominal description, tolerances of format 2, and true values of the uncertain numbers.

    Nominal values are within their tolerance of the true values; with `edge` in its outer fifth.
    """
    owner = copy.deepcopy(machine)
    said: dict[str, float] = {"default": ORDINARY}
    truth: dict[str, float] = {}
    for path, value in numbers(machine):
        share = tolerance(path)
        if share != ORDINARY and not path.endswith((".dac_bits", ".dac_range", ".noise")):
            said[path] = share
        if share == 0.0 or value == 0.0:
            continue
        r = rng.uniform(0.8, 1.0) * rng.choice([-1.0, 1.0]) if edge else rng.uniform(-0.9, 0.9)
        _set(owner, path, float(f"{value / (1.0 + share * r):.4g}"))
        truth[path] = float(f"{value:.6g}")
    return owner, said, truth


def _set(tree: Any, path: str, value: float) -> None:
    *above, last = path.split(".")
    for key in above:
        tree = tree[int(key)] if isinstance(tree, list) else tree[key]
    tree[last] = value
