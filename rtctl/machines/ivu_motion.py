"""Linear model of the Image Verification Unit from its command, and its mechanics for a feedforward."""

from typing import Any

from rtctl.drivers import l292
from rtctl.laws import allocation
from rtctl.machines.listed_motion import mechanics as listed
from rtctl.machines.profile import Model
from rtctl.machines.reference_motion import Mechanics
from rtctl.machines.told import unit_row
from rtctl.plants import ivu as plant


def model(config: Any, p: Any, blocks: dict[str, Any], motor: int) -> Model:
    """Model from the command to the angle of the capstan; `motor` (1 or 2) pulls where one pulls at a time."""
    A, B = plant.state_space(p)
    one, two = B[:, 0], -B[:, 1]  # input of a positive command through either motor
    pulls = {allocation.DIFFERENTIAL: (one + two) / 2, allocation.MOTOR1: one, allocation.MOTOR2: two}
    b = pulls.get(blocks["allocation"].kind, one if motor == 1 else two)
    return Model(A, b, unit_row(len(A), plant.CAPSTAN))


def mechanics(config: Any, dt: float) -> Mechanics:
    """Mechanics for a feedforward: motor 1 pulls at a positive command, motor 2 at a negative one."""
    driver = (*l292.second_order(config.plant.driver), config.plant.driver.R_F * config.plant.driver.C_F)
    p = plant.build(config.plant, dt, [driver, driver], config.plant.follow_tape)
    blocks = {"allocation": allocation.build(config.law.allocation, dt)}
    return listed(config, p, model(config, p, blocks, 1), model(config, p, blocks, 2))
