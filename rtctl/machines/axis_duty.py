"""Nominal duty of the axis, from the parameters of its config, without a recording.

Speeds of nodes follow from radii and gears. Forces accelerate the machine to nominal speed and overcome dry friction.
"""

from math import inf
from typing import Any

import numpy as np

from rtctl.machines.duty import Duty, Use

SPEED, TRAVEL = 0.09, 0.25  # m/s and m
QUICK = 5.0  # 1/s, acceleration divided by that speed
RECORDING = 25.0  # s, length of a recording


def use(node: str, config: Any) -> Use:
    """Nominal duty of a node."""
    p = config.plant.parameters
    force = float(np.sqrt((p.M * SPEED * QUICK) ** 2 + (p.F_v * SPEED) ** 2 + p.F_c**2 + (0.3 * p.k * TRAVEL) ** 2))
    return Use(SPEED, TRAVEL, force, p.F_c, p.M, p.k, inf, True)


def volts(config: Any) -> float:
    """Command of the nominal duty, V rms."""
    return float(use("carriage", config).force / config.plant.parameters.K)


DUTY = Duty(SPEED, TRAVEL, RECORDING, use, volts)
