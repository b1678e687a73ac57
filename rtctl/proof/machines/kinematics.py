"""Kinematic ratios, reflected inertia and stiff joints of a description, for sizing and equivalent nodes."""

import math
from typing import Any

Json = dict[str, Any]


def rotary(machine: Json, body: str) -> bool:
    return "inertia" in machine["bodies"][body]


def inertia(machine: Json, body: str) -> float:
    """Inertia of a body in kg m^2 or kg."""
    b = machine["bodies"][body]
    return float(b.get("inertia", b.get("mass", 0.0)))


def ratios(machine: Json, base: str) -> dict[str, float]:
    """Ratio of each body's coordinate to that of `base`, with rigid joints."""
    out = {base: 1.0}
    for _ in machine["bodies"]:
        for joint in machine["joints"].values():
            a, b, n = joint["from"], joint["to"], joint["ratio"]
            if a in out and b not in out:
                out[b] = n * out[a]
            elif b in out and a not in out:
                out[a] = out[b] / n
    return out


def reflected(machine: Json, base: str) -> float:
    """Inertia of the whole machine reflected to `base`, kg m^2 or kg."""
    return sum(g * g * inertia(machine, name) for name, g in ratios(machine, base).items())


def joint_hz(machine: Json, name: str) -> float:
    """Frequency in Hz of the mode of the two sides of a joint against each other; inf for a rigid joint."""
    joint = machine["joints"][name]
    if "stiffness" not in joint:
        return math.inf
    a, b, n = joint["from"], joint["to"], joint["ratio"]
    side = _beyond(machine, name, b)
    g = ratios(machine, b)
    far = sum(g[x] ** 2 * inertia(machine, x) for x in side)
    near = reflected(machine, b) - far
    if near <= 0.0:  # the joint closes a loop
        near, far = inertia(machine, a) / n**2, inertia(machine, b)
    return math.sqrt(joint["stiffness"] * (1.0 / near + 1.0 / far)) / (2.0 * math.pi)


def _beyond(machine: Json, cut: str, start: str) -> set[str]:
    """Bodies connected to `start` without the joint `cut`."""
    out = {start}
    for _ in machine["bodies"]:
        for name, joint in machine["joints"].items():
            if name != cut and (joint["from"] in out) != (joint["to"] in out):
                out |= {joint["from"], joint["to"]}
    return out


def measured(machine: Json) -> set[str]:
    """Bodies with a sensor."""
    return {s["body"] for s in machine["sensors"].values() if "body" in s}


def alike(machine: Json, body: str, band_hz: float) -> set[str]:
    """Bodies equivalent to `body` for a force, behind joints with modes far above `band_hz` and a sensorless end."""
    out, known = {body}, measured(machine)
    for _ in machine["bodies"]:
        for name, joint in machine["joints"].items():
            ends = {joint["from"], joint["to"]}
            if not ends & out or ends <= out or (ends <= known and "stiffness" in joint):
                continue
            if joint_hz(machine, name) > 3.0 * band_hz:
                out |= ends
    return out
