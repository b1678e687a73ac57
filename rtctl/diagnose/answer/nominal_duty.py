"""Nominal duty of a machine: measures for the sizes of effects."""

from math import pi
from typing import Any

from rtctl.machines import described_duty
from rtctl.machines.base import DESCRIBED
from rtctl.machines.duty import Duty, Use
from rtctl.machines.profiles import profile_of


def measure(what: str, node: str, config: Any) -> float:
    """Measure of a node in nominal duty, SI: the unit of a range of sizes."""
    u, dt = use(node, config), 1.0 / config.loop.rate
    volts = rms_volts(config)
    stiffness = u.stiffness or u.force / u.travel
    table = {
        "one": 1.0, "dry": u.dry or 0.3 * u.force, "force": u.force, "speed": u.speed, "travel": u.travel,
        "drag": u.force / u.speed, "stiff": u.force / u.travel, "inertia": u.inertia, "stiffness": stiffness,
        "cubic": stiffness**3 / u.force**2, "twist": u.force / stiffness if u.stiffness else 2e-3 * u.travel,
        "contact": u.contact, "per_contact": 1.0 / u.contact, "tick": dt, "hertz": 1.0 / dt,
        "rate": min(1.0 / dt, 1000.0), "volts": volts, "per_volt": 1.0 / volts, "peak": 2.5 * volts,
        "pace": 2.5 * volts * 2 * pi * u.speed / u.travel,
        "turn": u.travel / 7.0 if u.slides else 2 * pi, "lever": u.travel / 50.0 if u.slides else 1.0,
    }  # fmt: skip
    return table[what]


def rms_volts(config: Any) -> float:
    """Rms command in nominal duty, V or the unit of the drive."""
    return duty_of(config).volts(config)


def use(node: str, config: Any) -> Use:
    """Motion of a node in nominal duty."""
    return duty_of(config).use(node, config)


def duty_of(config: Any) -> Duty:
    """Nominal duty of the machine of a config: declared, or of a described machine by its reference."""
    if config.kind == DESCRIBED:
        return described_duty.duty(config)
    found = profile_of(config.kind).duty
    assert found is not None  # callers check the duty first
    return found
