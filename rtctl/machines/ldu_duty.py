"""Nominal duty of the Linear Drive Unit, from the parameters of its config, without a recording.

Speeds of nodes follow from radii and gears. Forces accelerate the machine to nominal speed and overcome dry friction.
"""

from typing import Any

import numpy as np

from rtctl.drivers.ldu_amplifier import AMPERE_PER_VOLT
from rtctl.machines.duty import Duty, Use
from rtctl.plants import ldu as plant

SPEED, TRAVEL = 0.04, 0.2  # m/s and m, of the carriage
QUICK = 3.0  # 1/s, acceleration divided by that speed
RECORDING = 10.0  # s, length of a recording


def use(node: str, config: Any) -> Use:
    """Nominal duty of a node."""
    p = plant.parameters(config.plant)
    N = p.R_t / p.R_s
    mass = p.M + (p.J_m * N**2 + p.J_t) / p.R_c**2
    force = float(np.hypot(mass * SPEED * QUICK, p.F_c))
    if node in ("carriage", "scale", "loop"):
        return Use(SPEED, TRAVEL, force, p.F_c, mass, 0.0, force, True)
    arm = p.R_c if node in ("wheel", "capstan", "encoder") else p.R_c / N
    stiffness = {"wheel": p.k_s, "capstan": p.k_c, "encoder": p.k_c}.get(node, p.k_s)
    contact = {"wheel": force * p.R_c / N, "capstan": force}.get(node, force * arm)
    dry = p.F_c * arm if node == "capstan" else 0.0
    return Use(SPEED / arm, TRAVEL / arm, force * arm, dry, mass * arm**2, stiffness, contact, False)


def volts(config: Any) -> float:
    """Command of the nominal duty, V rms."""
    return float(use("motor", config).force / (plant.parameters(config.plant).K_m1 * AMPERE_PER_VOLT))


DUTY = Duty(SPEED, TRAVEL, RECORDING, use, volts)
