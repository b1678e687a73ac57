"""Linear model of the Linear Drive Unit from its command, and its mechanics for a feedforward."""

from typing import Any

import numpy as np

from rtctl.drivers import ldu_amplifier
from rtctl.machines.listed_motion import mechanics as listed
from rtctl.machines.profile import Model
from rtctl.machines.reference_motion import Mechanics
from rtctl.machines.told import unit_row
from rtctl.plants import ldu as plant


def model(config: Any, p: Any, blocks: dict[str, Any], motor: int) -> Model:
    """Model from the command to the sensor of the feedback."""
    A, B = plant.state_space(p)
    c = config.sensors.R_c * unit_row(len(A), plant.ENCODER)
    if config.sensors.feedback == "scale":
        c = p.R_c * unit_row(len(A), plant.CAPSTAN)
    return Model(A, ldu_amplifier.AMPERE_PER_VOLT * B[:, 0], c)


def mechanics(config: Any, dt: float) -> Mechanics:
    """Mechanics for a feedforward."""
    p = plant.build(config.plant, dt, (2 * np.pi * config.plant.bandwidth, config.plant.damping))
    found = model(config, p, {}, 1)
    return listed(config, p, found, found, [ldu_amplifier.AMPERE_PER_VOLT])
