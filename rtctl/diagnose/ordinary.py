"""What a machine does in ordinary use, from the parameters of its config alone: no recording is needed.

The main node (capstan, carriage) moves at a nominal speed over a nominal travel; speeds of other nodes follow from
radii and gears, forces from what it takes to get there in time and to overcome dry friction.
"""

from math import inf, pi
from typing import Any, NamedTuple

import numpy as np

from rtctl.plants import ivu, ldu

USE = {"ivu": (2.5, 10.0, 2.5), "ldu": (0.04, 0.2, 3.0), "axis": (0.09, 0.25, 5.0)}  # speed, travel, 1/s to reach it
LDU_GAIN = 0.1  # A/V


class Use(NamedTuple):
    """A node in ordinary use, in its own unit."""

    speed: float
    travel: float
    force: float
    dry: float
    inertia: float
    stiffness: float
    contact: float
    slides: bool  # m, not rad


def measure(what: str, node: str, config: Any) -> float:
    """What a range is a multiple of, SI."""
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
    """Command that ordinary use takes."""
    if config.kind == "ivu":
        return use("motor1", config).force / (ivu.parameters(config.plant).K_m1 * config.law.tension.amp_per_volt)
    if config.kind == "ldu":
        return use("motor", config).force / (ldu.parameters(config.plant).K_m1 * LDU_GAIN)
    return use("carriage", config).force / config.plant.parameters.K


def use(node: str, config: Any) -> Use:
    """How a node moves in ordinary use; a drive, or the loop, as the node that moves first."""
    return {"ivu": _ivu, "ldu": _ldu, "axis": _axis}[config.kind](node, config.plant, *USE[config.kind])


def _ivu(node: str, plant: Any, speed: float, travel: float, hurry: float) -> Use:
    p = ivu.parameters(plant)
    side = "2" if node.endswith("2") else "1"
    R = getattr(p, f"R{side}")
    mass = p.J_m1 / p.R1**2 + p.J_m2 / p.R2**2  # kg of tape
    dry = getattr(p, f"tau_F{side}")
    torque = float(np.hypot(mass * R * p.R_c * speed * hurry, dry))
    drag = (p.tau_Fc + p.J_c * speed * hurry) / p.R_c  # N, what the tape gives to the capstan
    if node in ("capstan", "encoder"):
        return Use(speed, travel, torque * p.R_c / R, p.tau_Fc, mass * p.R_c**2, 0.0, drag, False)
    if node.startswith("tape"):
        stiffness = getattr(p, f"c{side}")
        return Use(speed * p.R_c, travel * p.R_c, torque / R, 0.0, mass, stiffness, drag, True)
    gear, stiffness = p.R_c / R, getattr(p, f"c_m{side}")
    own_dry = 0.0 if node.startswith("reel") else dry
    return Use(speed * gear, travel * gear, torque, own_dry, mass * R**2, stiffness, torque, False)


def _ldu(node: str, plant: Any, speed: float, travel: float, hurry: float) -> Use:
    p = ldu.parameters(plant)
    N = p.R_t / p.R_s
    mass = p.M + (p.J_m * N**2 + p.J_t) / p.R_c**2
    force = float(np.hypot(mass * speed * hurry, p.F_c))
    if node in ("carriage", "scale", "loop"):
        return Use(speed, travel, force, p.F_c, mass, 0.0, force, True)
    arm = p.R_c if node in ("wheel", "capstan", "encoder") else p.R_c / N
    stiffness = {"wheel": p.k_s, "capstan": p.k_c, "encoder": p.k_c}.get(node, p.k_s)
    contact = {"wheel": force * p.R_c / N, "capstan": force}.get(node, force * arm)
    dry = p.F_c * arm if node == "capstan" else 0.0
    return Use(speed / arm, travel / arm, force * arm, dry, mass * arm**2, stiffness, contact, False)


def _axis(node: str, plant: Any, speed: float, travel: float, hurry: float) -> Use:
    p = plant.parameters
    force = float(np.sqrt((p.M * speed * hurry) ** 2 + (p.F_v * speed) ** 2 + p.F_c**2 + (0.3 * p.k * travel) ** 2))
    return Use(speed, travel, force, p.F_c, p.M, p.k, inf, True)
