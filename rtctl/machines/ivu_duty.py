"""Nominal duty of the Image Verification Unit, from the parameters of its config, without a recording.

Speeds of nodes follow from radii and gears. Forces accelerate the machine to nominal speed and overcome dry friction.
"""

from typing import Any

import numpy as np

from rtctl.machines.duty import Duty, Use
from rtctl.plants import ivu as plant

SPEED, TRAVEL = 2.5, 10.0  # rad/s and rad, of the capstan
QUICK = 2.5  # 1/s, acceleration divided by that speed
RECORDING = 25.0  # s, length of a recording


def use(node: str, config: Any) -> Use:
    """Nominal duty of a node."""
    p = plant.parameters(config.plant)
    side = "2" if node.endswith("2") else "1"
    R = getattr(p, f"R{side}")
    mass = p.J_m1 / p.R1**2 + p.J_m2 / p.R2**2  # kg of tape
    dry = getattr(p, f"tau_F{side}")
    torque = float(np.hypot(mass * R * p.R_c * SPEED * QUICK, dry))
    drag = (p.tau_Fc + p.J_c * SPEED * QUICK) / p.R_c  # N, force of the tape on the capstan
    if node in ("capstan", "encoder"):
        return Use(SPEED, TRAVEL, torque * p.R_c / R, p.tau_Fc, mass * p.R_c**2, 0.0, drag, False)
    if node.startswith("tape"):
        stiffness = getattr(p, f"c{side}")
        return Use(SPEED * p.R_c, TRAVEL * p.R_c, torque / R, 0.0, mass, stiffness, drag, True)
    gear, stiffness = p.R_c / R, getattr(p, f"c_m{side}")
    own_dry = 0.0 if node.startswith("reel") else dry
    return Use(SPEED * gear, TRAVEL * gear, torque, own_dry, mass * R**2, stiffness, torque, False)


def volts(config: Any) -> float:
    """Command of the nominal duty, V rms."""
    return float(use("motor1", config).force / (plant.parameters(config.plant).K_m1 * config.law.tension.amp_per_volt))


DUTY = Duty(SPEED, TRAVEL, RECORDING, use, volts)
